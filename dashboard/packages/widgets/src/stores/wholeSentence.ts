/** `text` with a full stop where it has no end of its own, so that another sentence may follow. */
export function wholeSentence(text: string): string {
  return text === '' || /[.?!:…]$/.test(text) ? text : `${text}.`
}
