import { Value, type Readable } from '@mosaic/client'

/** Keeps the last picture of a stream that has ended, for whoever waits for the next one. */
export class KeptPicture {
  private readonly kept = new Value<HTMLCanvasElement | null>(null)

  readonly canvas: Readable<HTMLCanvasElement | null> = this.kept

  /** To be called while the stream is still in the element. */
  keep(video: HTMLVideoElement): void {
    const picture = copied(video)
    if (picture !== null) this.kept.set(picture)
  }

  drop(): void {
    this.kept.set(null)
  }
}

/** Of `HTMLMediaElement`: there is a picture. */
const HAVE_CURRENT_DATA = 2

/** What the element shows, at its full resolution; null where it shows nothing. */
export function copied(video: HTMLVideoElement): HTMLCanvasElement | null {
  const { videoWidth, videoHeight, readyState } = video
  if (videoWidth === 0 || videoHeight === 0 || readyState < HAVE_CURRENT_DATA) return null
  const canvas = document.createElement('canvas')
  canvas.width = videoWidth
  canvas.height = videoHeight
  canvas.getContext('2d')?.drawImage(video, 0, 0, videoWidth, videoHeight)
  return canvas
}
