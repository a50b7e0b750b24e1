/** Codes come in the URL's fragment, which no server sees; they leave the address bar before they are used. */

export interface PageAddress {
  location: Pick<Location, 'hash' | 'pathname' | 'search'>
  history: Pick<History, 'replaceState' | 'state'>
}

/** What signs this page in: `#code=` of an account, `#pair=` of a robot that pairs a device. */
export interface AddressCode {
  kind: 'code' | 'pair'
  value: string
}

export function takeAddressCode({ location, history }: PageAddress): AddressCode | null {
  const fragment = new URLSearchParams(location.hash.replace(/^#/, ''))
  const found = KINDS.map((kind) => ({ kind, value: fragment.get(kind) })).filter(({ value }) => value !== null)
  if (found.length === 0) return null
  for (const { kind } of found) fragment.delete(kind)
  const rest = fragment.toString()
  history.replaceState(history.state, '', location.pathname + location.search + (rest === '' ? '' : `#${rest}`))
  const [first] = found
  return first === undefined || !first.value ? null : { kind: first.kind, value: first.value }
}

const KINDS = ['code', 'pair'] as const
