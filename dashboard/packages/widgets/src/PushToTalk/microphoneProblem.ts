/** What keeps a page from the microphone, in words that say what to do. */

export const NO_SECURE_CONTEXT =
  'The browser gives a page the microphone over https:// only (or on localhost). Open the dashboard that way.'

const SENTENCES: Readonly<Record<string, string>> = {
  NotAllowedError: 'This page may not use the microphone. Allow it beside the address, then hold again.',
  NotFoundError: 'No microphone was found. Plug one in.',
  NotReadableError: 'The microphone can’t be used; another program may hold it.',
}

export function microphoneProblem(error: unknown): string {
  const name = error instanceof Error || error instanceof DOMException ? error.name : ''
  return SENTENCES[name] ?? `The microphone can’t be used (${error instanceof Error ? error.message : String(error)}).`
}
