/** A one-time code comes in the URL's fragment, which no server sees; it leaves the address bar before it is used. */

export interface PageAddress {
  location: Pick<Location, 'hash' | 'pathname' | 'search'>
  history: Pick<History, 'replaceState' | 'state'>
}

export function takeOneTimeCode({ location, history }: PageAddress): string | null {
  const fragment = new URLSearchParams(location.hash.replace(/^#/, ''))
  const code = fragment.get('code')
  if (code === null) return null
  fragment.delete('code')
  const rest = fragment.toString()
  history.replaceState(history.state, '', location.pathname + location.search + (rest === '' ? '' : `#${rest}`))
  return code === '' ? null : code
}
