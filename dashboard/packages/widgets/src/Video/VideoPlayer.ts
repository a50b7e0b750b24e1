/** Plays a stream in a `<video>` and writes what is measured about it over the picture, without React. */
import { onEveryFrame } from '../pictures/everyFrame'
import { FrameMeter, type PictureState } from '../pictures/frameMeter'
import { PictureAges } from '../pictures/pictureAges'
import { recordOf, type Measured, type PictureRecord } from '../pictures/pictureRecords'
import { detailsText, pictureText } from '../pictures/pictureText'
import { exactAge } from '../stores/age'

const PERIOD_MS = 250
const RECORD_EVERY = 1000 / PERIOD_MS

export interface PlayerElements {
  video: HTMLVideoElement
  facts: HTMLElement
  alarm: HTMLElement
}

export interface PlayerOptions {
  stream: MediaStream | null
  /** When the page began to watch, by `performance.now()`. */
  beganMs: number
  /** Tells the store of a picture on the screen; its age then, null while unknown. */
  pictureShown: (rtpTimestamp: number | null, atMs: number) => number | null
  measured: () => Pick<Measured, 'roundTripMs' | 'statistics'>
  /** Everything that is known, or just the line. */
  showsDetails: () => boolean
  onState: (state: PictureState) => void
  onRecord: (record: PictureRecord) => void
  /** The stream is about to leave the element. */
  onEnd: () => void
}

/** Plays until the result is called. */
export function playPicture({ video, facts, alarm }: PlayerElements, options: PlayerOptions): () => void {
  const { stream } = options
  const meter = new FrameMeter()
  const ages = new PictureAges()
  let looks = 0
  video.srcObject = stream
  if (stream !== null) playMuted(video)
  const stopCounting = onEveryFrame(video, (nowMs, frame) => {
    meter.add(nowMs)
    const atMs = (frame?.expectedDisplayTime ?? nowMs) + performance.timeOrigin
    const ageMs = options.pictureShown(frame?.rtpTimestamp ?? null, atMs)
    if (ageMs !== null) ages.add(nowMs, ageMs)
  })
  const show = () => {
    const now = performance.now()
    const state = stream === null ? 'none' : meter.state(now)
    const measured: Measured = { ...options.measured(), state, ages: ages.summary(now), framesPerSecond: meter.framesPerSecond(now) }
    options.onState(state)
    alarm.textContent = state === 'stale' ? frozenText(meter.ageMs(now) ?? 0) : ''
    const size = { widthPx: video.videoWidth, heightPx: video.videoHeight }
    facts.textContent = options.showsDetails() ? detailsText({ ...measured, ...size }) : pictureText({ ...measured, ...size })
    if (stream !== null && looks++ % RECORD_EVERY === 0) options.onRecord(recordOf((now - options.beganMs) / 1000, measured))
  }
  const timer = setInterval(show, PERIOD_MS)
  return () => {
    clearInterval(timer)
    stopCounting()
    options.onEnd()
    video.srcObject = null
    facts.textContent = ''
    alarm.textContent = ''
  }
}

export function frozenText(ageMs: number): string {
  return `Picture frozen for ${exactAge(ageMs)}`
}

function playMuted(video: HTMLVideoElement): void {
  // React does not render `muted` as an attribute; without it browsers refuse to play by themselves.
  video.muted = true
  // Refused only while another stream takes over: that one plays.
  video.play().catch(() => {})
}
