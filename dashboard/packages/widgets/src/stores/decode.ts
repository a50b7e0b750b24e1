/** Bytes of a message to what widgets show. */
const decoder = new TextDecoder()

export type Decoded = { ok: true; value: unknown } | { ok: false; text: string }

export function textOf(data: ArrayBuffer): string {
  return decoder.decode(data)
}

export function jsonOf(data: ArrayBuffer): Decoded {
  const text = textOf(data)
  try {
    return { ok: true, value: JSON.parse(text) as unknown }
  } catch {
    return { ok: false, text }
  }
}
