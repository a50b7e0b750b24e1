/** How the timestamps of the pictures that this page sends are read, so that operators know how old a picture is. */

/** RTP timestamp = this page's clock in milliseconds × 90 + `rtpOrigin`, modulo 2^32. */
export interface PictureOrigin {
  ssrc: number
  rtpOrigin: number
}

/** What the worker tells of one line. */
export interface OriginNews extends PictureOrigin {
  id: number
}

export interface TransformOptions {
  id: number
}

/** Whose timestamps are read. */
export type PictureLine = Pick<RTCRtpSender, 'transform'>

/** Tells the origin of a line whenever it is news; the result ends that. */
export type PictureTimes = (line: PictureLine, told: (origin: PictureOrigin) => void) => () => void

/** What of a `Worker` is needed. */
export type TimesWorker = Pick<Worker, 'onmessage'>

/** Null where the browser does not let a page see what it sends: then nobody knows how old its pictures are. */
export function browserPictureTimes(): PictureTimes | null {
  if (!('RTCRtpScriptTransform' in globalThis)) return null
  return workerPictureTimes(
    () => new Worker(new URL('./pictureTimes.worker.ts', import.meta.url), { type: 'module' }),
    (worker, options) => new RTCRtpScriptTransform(worker, options),
  )
}

/**
 * The origins that one worker reads for all lines. It is made at once: browsers let a line go through a worker only from its
 * beginning. One that comes before the worker runs, or where none can be had, sends all the same; its origin is not known.
 */
export function workerPictureTimes<W extends TimesWorker>(
  makeWorker: () => W,
  makeTransform: (worker: W, options: TransformOptions) => RTCRtpScriptTransform,
): PictureTimes {
  const listeners = new Map<number, (origin: PictureOrigin) => void>()
  const worker = makeWorker()
  let isReady = false
  let lastId = 0
  worker.onmessage = ({ data }: MessageEvent<OriginNews | 'ready'>) => {
    if (data === 'ready') isReady = true
    else listeners.get(data.id)?.({ ssrc: data.ssrc, rtpOrigin: data.rtpOrigin })
  }
  return (line, told) => {
    if (!isReady) return () => {}
    const id = ++lastId
    listeners.set(id, told)
    line.transform = makeTransform(worker, { id })
    return () => {
      listeners.delete(id)
    }
  }
}
