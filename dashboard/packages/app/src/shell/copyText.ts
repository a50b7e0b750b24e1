/** Puts a text onto the clipboard, also where the browser has no `navigator.clipboard`: on plain http from another machine. */
export async function copyText(text: string, near: HTMLElement): Promise<boolean> {
  try {
    await navigator.clipboard.writeText(text)
    return true
  } catch {
    return copiedBySelection(text, near)
  }
}

/** `near`: inside of the same dialog, whose focus trap takes the focus back from anything outside. */
function copiedBySelection(text: string, near: HTMLElement): boolean {
  const field = document.createElement('textarea')
  field.value = text
  field.readOnly = true
  field.style.cssText = 'position: fixed; opacity: 0; pointer-events: none'
  const focused = document.activeElement
  near.append(field)
  field.focus({ preventScroll: true })
  field.select()
  try {
    // eslint-disable-next-line @typescript-eslint/no-deprecated -- the only way without a secure context
    return document.execCommand('copy')
  } catch {
    return false
  } finally {
    field.remove()
    if (focused instanceof HTMLElement) focused.focus()
  }
}
