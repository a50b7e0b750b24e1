/** Reads the timestamps of encoded pictures on their way out; the pictures pass as they are. */
import type { OriginNews, TransformOptions } from './pictureTimes'
import { RtpOrigin } from './RtpOrigin'

/** What of an `RTCEncodedVideoFrame` is needed; TypeScript knows its metadata without the timestamp. */
interface EncodedPicture {
  getMetadata(): { rtpTimestamp?: number; synchronizationSource?: number }
}

/** What of an `RTCTransformEvent` is needed; TypeScript knows it in workers alone. */
interface TransformEvent extends Event {
  transformer: { readable: ReadableStream<EncodedPicture>; writable: WritableStream<EncodedPicture>; options: TransformOptions }
}

addEventListener('rtctransform', (event) => {
  const { readable, writable, options } = (event as TransformEvent).transformer
  const origin = new RtpOrigin()
  const look = ({ rtpTimestamp, synchronizationSource: ssrc }: ReturnType<EncodedPicture['getMetadata']>): void => {
    if (rtpTimestamp === undefined || ssrc === undefined) return
    const rtpOrigin = origin.seen(rtpTimestamp, performance.timeOrigin + performance.now())
    if (rtpOrigin !== null) postMessage({ id: options.id, ssrc, rtpOrigin } satisfies OriginNews)
  }
  const looking = new TransformStream<EncodedPicture, EncodedPicture>({
    transform: (picture, out) => {
      const metadata = picture.getMetadata()
      // First: it may be sent, and is then somebody else's.
      out.enqueue(picture)
      look(metadata)
    },
  })
  // It ends with the connection, one way or another.
  readable.pipeThrough(looking).pipeTo(writable).catch(() => {})
})

postMessage('ready')
