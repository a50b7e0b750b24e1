/** A still or a recording of the picture as the browser has it, for the downloads of whoever watches. */
import { download, fileName } from '../frame/download'
import { copied } from './KeptPicture'

/** The picture on the screen, at its full resolution. Rejects where there is none. */
export async function snapshot(video: HTMLVideoElement): Promise<Blob> {
  const canvas = copied(video)
  if (canvas === null) throw new Error('there is no picture yet')
  return await new Promise((resolve, reject) => {
    canvas.toBlob((blob) => (blob === null ? reject(new Error('the browser made no picture')) : resolve(blob)), 'image/png')
  })
}

export function saveStill(label: string, png: Blob): void {
  download(`${fileName(label, stamp())}.png`, png)
}

/** The robot changes the resolution with the network: not every container survives that (`avc1` in MP4 does not). */
const TYPES = ['video/webm;codecs=vp9', 'video/webm;codecs=vp8', 'video/webm', 'video/mp4;codecs=avc3.42E01E', 'video/mp4']
/** Blocks this long reach memory at once: what was recorded survives a broken stream. */
const BLOCK_MS = 1000

export interface Recording {
  /** Ends it and hands the file to the downloads. */
  end(): void
}

export function canRecord(): boolean {
  return typeof MediaRecorder !== 'undefined'
}

/** Records the stream until `end`, or until it stops by itself; `onEnd` is called once either way. */
export function record(label: string, stream: MediaStream, onEnd: () => void): Recording {
  const mimeType = TYPES.find((type) => MediaRecorder.isTypeSupported(type))
  const recorder = new MediaRecorder(stream, mimeType === undefined ? {} : { mimeType })
  const blocks: Blob[] = []
  const name = fileName(label, stamp())
  recorder.addEventListener('dataavailable', ({ data }) => {
    if (data.size > 0) blocks.push(data)
  })
  recorder.addEventListener('stop', () => {
    const type = recorder.mimeType
    if (blocks.length > 0) download(`${name}.${type.includes('mp4') ? 'mp4' : 'webm'}`, new Blob(blocks, { type }))
    onEnd()
  })
  recorder.start(BLOCK_MS)
  return { end: () => recorder.state !== 'inactive' && recorder.stop() }
}

/** Local time, for people and for sorting: `2026-03-01 14:03:07`. */
function stamp(): string {
  return new Intl.DateTimeFormat('sv-SE', { dateStyle: 'short', timeStyle: 'medium' }).format()
}
