/** Reads and writes the messages of the signaling sockets and of the control channel. */
import {
  ALIASES,
  CONTROL_SCHEMAS,
  SIGNALING_SCHEMAS,
  type ControlMessages,
  type SignalingMessages,
} from './generated'
import { Mismatch, validated } from './validated'
import { WireError } from './WireError'

/** One signaling message; `error` is a request that the server refused, with its ResultCode. */
export type SignalingMessage =
  | { [T in keyof SignalingMessages]: { type: T; data: SignalingMessages[T] } }[keyof SignalingMessages]
  | { type: 'error'; requestType: string; code: number }
  | { type: 'unknown'; unknownType: string }

/** One message of `_mosaic`. */
export type ControlMessage = { [T in keyof ControlMessages]: { type: T; data: ControlMessages[T] } }[keyof ControlMessages]

/** Read one frame of a signaling socket. Throws `WireError` (`signal.bad_message`). */
export function parseSignaling(text: string): SignalingMessage {
  const { type, data } = envelopeOf(text)
  if (typeof data === 'number' && Number.isInteger(data)) {
    return type === 'authorize.res' ? { type, data } : { type: 'error', requestType: type, code: data }
  }
  const known = Object.hasOwn(ALIASES, type) ? (ALIASES[type] ?? type) : type
  if (!Object.hasOwn(SIGNALING_SCHEMAS, known)) return { type: 'unknown', unknownType: type.slice(0, 100) }
  const name = SIGNALING_SCHEMAS[known as keyof typeof SIGNALING_SCHEMAS]
  return { type: known, data: fitting(type, name, data ?? {}) } as SignalingMessage
}

/** Read one message of `_mosaic`; null for a type that we don't know. Throws `WireError`. */
export function parseControl(text: string): ControlMessage | null {
  const { type, data } = envelopeOf(text)
  if (!Object.hasOwn(CONTROL_SCHEMAS, type)) return null
  const name = CONTROL_SCHEMAS[type as keyof typeof CONTROL_SCHEMAS]
  return { type, data: fitting(type, name, data ?? {}) } as ControlMessage
}

/** The text of a signaling message, with exactly the keys of `data`. */
export function signalingText<T extends keyof SignalingMessages>(type: T, data: SignalingMessages[T]): string {
  const isEmptyRequest = type === 'authorize.req' && Object.keys(data).length === 0
  return JSON.stringify({ type, data: isEmptyRequest ? null : data })
}

/** The text of a control message. */
export function controlText<T extends keyof ControlMessages>(type: T, data: ControlMessages[T]): string {
  return JSON.stringify({ type, data })
}

function envelopeOf(text: string): { type: string; data: unknown } {
  let envelope: unknown
  try {
    envelope = JSON.parse(text)
  } catch {
    throw new WireError('not JSON')
  }
  if (typeof envelope !== 'object' || envelope === null || !('type' in envelope) || typeof envelope.type !== 'string') {
    throw new WireError('no envelope with a type')
  }
  return { type: envelope.type, data: 'data' in envelope ? envelope.data : undefined }
}

function fitting(type: string, name: string, data: unknown): unknown {
  try {
    return validated(name, data)
  } catch (error) {
    if (error instanceof Mismatch) throw new WireError(`${type}: wrong or missing ${error.message}`)
    throw error
  }
}
