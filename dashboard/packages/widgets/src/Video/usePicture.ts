/** Plays a stream and writes what is measured about it over the picture, past React. */
import type { RobotConnection } from '@mosaic/client'
import { useReadable } from '@mosaic/react'
import { useEffect, useEffectEvent, type RefObject } from 'react'
import type { ShowsMedia } from '../stores/storeKinds'
import { FrameMeter, type PictureState } from './frameMeter'
import { pictureText } from './pictureText'

const PERIOD_MS = 250

export interface PictureOptions {
  store: ShowsMedia
  stream: MediaStream | null
  connection: RobotConnection
  video: RefObject<HTMLVideoElement | null>
  facts: RefObject<HTMLElement | null>
  alarm: RefObject<HTMLElement | null>
  onState: (state: PictureState) => void
}

export function usePicture({ store, stream, connection, video, facts, alarm, onState }: PictureOptions): void {
  const statistics = useReadable(store.statistics)
  const show = useEffectEvent((meter: FrameMeter, pictureAgeMs: number | null) => {
    const now = performance.now()
    const state = stream === null ? 'none' : meter.state(now)
    onState(state)
    if (alarm.current !== null) {
      alarm.current.textContent = state === 'stale' ? frozenText(meter.ageMs(now) ?? 0) : ''
    }
    if (facts.current !== null) {
      facts.current.textContent = pictureText({
        framesPerSecond: meter.framesPerSecond(now),
        widthPx: video.current?.videoWidth ?? 0,
        heightPx: video.current?.videoHeight ?? 0,
        roundTripMs: connection.state.get().roundTripMs,
        pictureAgeMs: state === 'live' ? pictureAgeMs : null,
        statistics,
      })
    }
  })
  useEffect(() => {
    const element = video.current
    if (element === null) return undefined
    const meter = new FrameMeter()
    let pictureAgeMs: number | null = null
    element.srcObject = stream
    if (stream !== null) playMuted(element)
    const stopCounting = onEveryFrame(element, (nowMs, frame) => {
      meter.add(nowMs)
      pictureAgeMs =
        frame?.rtpTimestamp === undefined
          ? null
          : store.pictureAgeMs(frame.rtpTimestamp, frame.expectedDisplayTime + performance.timeOrigin)
    })
    const timer = setInterval(() => show(meter, pictureAgeMs), PERIOD_MS)
    return () => {
      clearInterval(timer)
      stopCounting()
      element.srcObject = null
    }
  }, [store, stream, video])
}

function frozenText(ageMs: number): string {
  return `Picture frozen for ${(ageMs / 1000).toFixed(1)} s`
}

function playMuted(element: HTMLVideoElement): void {
  // React does not render `muted` as an attribute; without it browsers refuse to play by themselves.
  element.muted = true
  // Refused only while another stream takes over: that one plays.
  element.play().catch(() => {})
}

/** Tells of every picture that is put on the screen. */
function onEveryFrame(
  element: HTMLVideoElement,
  listener: (nowMs: number, frame?: VideoFrameCallbackMetadata) => void,
): () => void {
  if (typeof element.requestVideoFrameCallback !== 'function') {
    const onTime = () => listener(performance.now())
    element.addEventListener('timeupdate', onTime)
    return () => element.removeEventListener('timeupdate', onTime)
  }
  let handle = 0
  const next = () => {
    handle = element.requestVideoFrameCallback((_now, frame) => {
      listener(performance.now(), frame)
      next()
    })
  }
  next()
  return () => element.cancelVideoFrameCallback(handle)
}
