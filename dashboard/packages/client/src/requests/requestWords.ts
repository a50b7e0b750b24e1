/** What a robot says on the channel of a connector that answers requests; the reference of the wire has every form. */
import { plainText } from '@mosaic/protocol'

/** How a request goes on or ends, by the id that the page gave it. */
export type RequestReply =
  | { readonly id: string; readonly kind: 'progress'; readonly progress: unknown }
  | { readonly id: string; readonly kind: 'answer'; readonly answer: unknown }
  | { readonly id: string; readonly kind: 'refused'; readonly code: string; readonly message: string }

/** Null where it is no reply to a numbered request. */
export function replyOf(data: ArrayBuffer): RequestReply | null {
  const value = parsed(data)
  if (value === null || typeof value.id !== 'string') return null
  const { id } = value
  if ('answer' in value) return { id, kind: 'answer', answer: value.answer }
  if ('progress' in value) return { id, kind: 'progress', progress: value.progress }
  if (!isObject(value.refused)) return null
  return { id, kind: 'refused', code: text(value.refused.code), message: text(value.refused.message) }
}

function parsed(data: ArrayBuffer): Record<string, unknown> | null {
  try {
    const value: unknown = JSON.parse(new TextDecoder().decode(data))
    return isObject(value) ? value : null
  } catch {
    return null
  }
}

function isObject(value: unknown): value is Record<string, unknown> {
  return typeof value === 'object' && value !== null && !Array.isArray(value)
}

function text(value: unknown): string {
  return typeof value === 'string' ? plainText(value) : ''
}
