/** Shows and checks the PIN with which a robot on the LAN pairs devices. */

/** As many as the server makes. */
export const PIN_DIGITS = 8

/** What was typed or pasted as it is shown: digits alone, in two halves. */
export function shownPin(typed: string): string {
  const digits = typed.replace(/\D/g, '').slice(0, PIN_DIGITS)
  const half = PIN_DIGITS / 2
  return digits.length > half ? `${digits.slice(0, half)} ${digits.slice(half)}` : digits
}

export function isWholePin(shown: string): boolean {
  return shown.replace(/\D/g, '').length === PIN_DIGITS
}
