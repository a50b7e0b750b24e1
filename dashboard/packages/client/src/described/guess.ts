/** What travels on a label that nobody described, told from what arrived there. Pure. */
import type { MosaicDataType } from '@mosaic/protocol'

/** What travels on a label, as far as what came there tells. */
export interface Guess {
  dataType: MosaicDataType
  /** The newest value, where it is JSON. */
  value?: unknown
}

/** Null while nothing arrived: what only receives says nothing either. */
export function guessOf(messages: readonly ArrayBuffer[], hasPicture = false): Guess | null {
  if (hasPicture) return { dataType: 'media' }
  const texts = messages.map(textOf)
  const last = texts.at(-1)
  if (last === undefined) return null
  if (texts.includes(null) || last === null) return { dataType: 'byte-r2u' }
  const values = texts.map((text) => jsonOf(text ?? ''))
  return values.includes(undefined) ? { dataType: 'string-r2u' } : { dataType: 'json-r2u', value: values.at(-1) }
}

/** Null: these bytes are no text. */
function textOf(data: ArrayBuffer): string | null {
  try {
    const text = new TextDecoder('utf-8', { fatal: true }).decode(data)
    // Text has no control characters but white space; numbers in binary are full of them.
    // eslint-disable-next-line no-control-regex
    return /[\u0000-\u0008\u000e-\u001f]/.test(text) ? null : text
  } catch {
    return null
  }
}

function jsonOf(text: string): unknown {
  try {
    return JSON.parse(text)
  } catch {
    return undefined
  }
}
