/** Red, green and blue, 0 to 1, of a colour written `#rrggbb`; grey for any other. */
export function rgbOf(colour: string): readonly [number, number, number] {
  const hex = /^#([0-9a-f]{2})([0-9a-f]{2})([0-9a-f]{2})$/i.exec(colour.trim())
  if (hex === null) return [0.5, 0.5, 0.5]
  const part = (index: number) => Number.parseInt(hex[index] ?? '80', 16) / 255
  return [part(1), part(2), part(3)]
}
