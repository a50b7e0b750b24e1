/** Plays a stream in a `<video>` and writes what is measured about it over the picture, without React. */
import { FrameMeter, type PictureState } from './frameMeter'
import { pictureText, type PictureFacts } from './pictureText'

const PERIOD_MS = 250

export interface PlayerElements {
  video: HTMLVideoElement
  facts: HTMLElement
  alarm: HTMLElement
}

export interface PlayerOptions {
  stream: MediaStream | null
  /** Age of the picture with this RTP timestamp when it is displayed; null while unknown. */
  pictureAgeMs: (rtpTimestamp: number, atMs: number) => number | null
  measured: () => Pick<PictureFacts, 'roundTripMs' | 'statistics'>
  onState: (state: PictureState) => void
}

/** Plays until the result is called. */
export function playPicture({ video, facts, alarm }: PlayerElements, options: PlayerOptions): () => void {
  const { stream } = options
  const meter = new FrameMeter()
  let pictureAgeMs: number | null = null
  video.srcObject = stream
  if (stream !== null) playMuted(video)
  const stopCounting = onEveryFrame(video, (nowMs, frame) => {
    meter.add(nowMs)
    pictureAgeMs =
      frame?.rtpTimestamp === undefined
        ? null
        : options.pictureAgeMs(frame.rtpTimestamp, frame.expectedDisplayTime + performance.timeOrigin)
  })
  const show = () => {
    const now = performance.now()
    const state = stream === null ? 'none' : meter.state(now)
    options.onState(state)
    alarm.textContent = state === 'stale' ? frozenText(meter.ageMs(now) ?? 0) : ''
    facts.textContent = pictureText({
      ...options.measured(),
      framesPerSecond: meter.framesPerSecond(now),
      widthPx: video.videoWidth,
      heightPx: video.videoHeight,
      pictureAgeMs: state === 'live' ? pictureAgeMs : null,
    })
  }
  const timer = setInterval(show, PERIOD_MS)
  return () => {
    clearInterval(timer)
    stopCounting()
    video.srcObject = null
    facts.textContent = ''
    alarm.textContent = ''
  }
}

export function frozenText(ageMs: number): string {
  return `Picture frozen for ${(ageMs / 1000).toFixed(1)} s`
}

function playMuted(video: HTMLVideoElement): void {
  // React does not render `muted` as an attribute; without it browsers refuse to play by themselves.
  video.muted = true
  // Refused only while another stream takes over: that one plays.
  video.play().catch(() => {})
}

/** Tells of every picture that is put on the screen. */
function onEveryFrame(
  video: HTMLVideoElement,
  listener: (nowMs: number, frame?: VideoFrameCallbackMetadata) => void,
): () => void {
  if (!('requestVideoFrameCallback' in video)) return onTimeUpdate(video, () => listener(performance.now()))
  let handle = 0
  const next = () => {
    handle = video.requestVideoFrameCallback((_now, frame) => {
      listener(performance.now(), frame)
      next()
    })
  }
  next()
  return () => video.cancelVideoFrameCallback(handle)
}

/** Older browsers only say that the picture moved on; enough to tell a live picture from a frozen one. */
function onTimeUpdate(video: HTMLElement, listener: () => void): () => void {
  video.addEventListener('timeupdate', listener)
  return () => video.removeEventListener('timeupdate', listener)
}
