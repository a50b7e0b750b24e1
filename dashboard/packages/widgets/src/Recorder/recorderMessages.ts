/** What a robot's recorder says, read with tolerance, and its numbers for people. Pure. */

export type RecorderState = 'idle' | 'recording' | 'paused'

/** Of one camera, or of the data. */
export interface OneRecording {
  kind: 'camera' | 'data'
  label: string
  state: string
  seconds: number
  bytes: number
  /** Of data. */
  messages: number
  dropped: number
  code: string
}

export interface RecorderStatus {
  type: 'status'
  state: RecorderState
  labels: readonly string[]
  recordings: readonly OneRecording[]
  seconds: number
  freeBytes: number | null
}

export interface RecordedFile {
  name: string
  bytes: number
  modifiedAtS: number
  isOpen: boolean
}

export interface FileList {
  type: 'files'
  directory: string
  files: readonly RecordedFile[]
}

export interface SnapshotTaken {
  type: 'snapshot'
  requestId: string
  label: string
  file: string
  code: string
  pngBase64: string | null
}

export type RecorderMessage = RecorderStatus | FileList | SnapshotTaken

/** Null for what is none of the recorder's messages. */
export function recorderMessage(value: unknown): RecorderMessage | null {
  const given = recordOf(value)
  switch (given['type']) {
    case 'status':
      return statusOf(given)
    case 'files':
      return { type: 'files', directory: text(given['directory']), files: list(given['files']).map(fileOf) }
    case 'snapshot':
      return snapshotOf(given)
    default:
      return null
  }
}

function statusOf(given: Record<string, unknown>): RecorderStatus {
  const state = given['state']
  return {
    type: 'status',
    state: state === 'recording' || state === 'paused' ? state : 'idle',
    labels: list(given['labels']).map(text),
    recordings: list(given['recordings']).map(recordingOf),
    seconds: number(given['seconds']),
    freeBytes: typeof given['free_bytes'] === 'number' ? given['free_bytes'] : null,
  }
}

function recordingOf(value: unknown): OneRecording {
  const given = recordOf(value)
  return {
    kind: given['kind'] === 'data' ? 'data' : 'camera',
    label: text(given['label']),
    state: text(given['state']),
    seconds: number(given['seconds']),
    bytes: number(given['bytes']),
    messages: number(given['messages']),
    dropped: number(given['dropped']),
    code: text(given['code']),
  }
}

function fileOf(value: unknown): RecordedFile {
  const given = recordOf(value)
  return {
    name: text(given['name']),
    bytes: number(given['bytes']),
    modifiedAtS: number(given['modified_at_s']),
    isOpen: given['is_open'] === true,
  }
}

function snapshotOf(given: Record<string, unknown>): SnapshotTaken {
  return {
    type: 'snapshot',
    requestId: text(given['request_id']),
    label: text(given['label']),
    file: text(given['file']),
    code: text(given['code']),
    pngBase64: typeof given['png_base64'] === 'string' ? given['png_base64'] : null,
  }
}

/** `3:07`, `1:02:03`. */
export function formattedDuration(seconds: number): string {
  const whole = Math.max(0, Math.floor(seconds))
  const two = (part: number) => String(part).padStart(2, '0')
  const minutes = Math.floor(whole / 60) % 60
  const hours = Math.floor(whole / 3600)
  return hours > 0 ? `${hours}:${two(minutes)}:${two(whole % 60)}` : `${minutes}:${two(whole % 60)}`
}

/** `1.2 MB`, in powers of ten as disks are sold. */
export function formattedBytes(bytes: number): string {
  const [unit, size] = ([['TB', 1e12], ['GB', 1e9], ['MB', 1e6], ['kB', 1e3]] as const).find(([, one]) => bytes >= one) ?? ['B', 1]
  const value = bytes / size
  return `${value < 10 && size > 1 ? value.toFixed(1) : Math.round(value)} ${unit}`
}

function recordOf(value: unknown): Record<string, unknown> {
  return typeof value === 'object' && value !== null ? (value as Record<string, unknown>) : {}
}

function list(value: unknown): unknown[] {
  return Array.isArray(value) ? (value as unknown[]) : []
}

function text(value: unknown): string {
  return typeof value === 'string' ? value : ''
}

function number(value: unknown): number {
  return typeof value === 'number' && Number.isFinite(value) ? value : 0
}
