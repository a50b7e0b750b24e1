/** Plays a stream in an `<audio>` and moves its level meter, without React. */
import { levelDb, meterShare, QUIET_DB } from './soundLevel'

const PERIOD_MS = 66
/** 43 ms at 48 kHz: one look per period sees nearly everything. */
const WINDOW_SAMPLES = 2048

export interface SoundElements {
  audio: HTMLAudioElement
  meter: HTMLElement
}

/** Plays until the result is called. `onBlocked`: the browser wants a click first. */
export function playSound({ audio, meter }: SoundElements, stream: MediaStream, onBlocked: () => void): () => void {
  audio.srcObject = stream
  audio.play().catch((error: unknown) => {
    if (error instanceof DOMException && error.name === 'NotAllowedError') onBlocked()
  })
  const endMeter = moveMeter(meter, stream)
  return () => {
    endMeter()
    audio.srcObject = null
  }
}

function moveMeter(meter: HTMLElement, stream: MediaStream): () => void {
  // Where there is no WebAudio there is sound without a meter.
  if (typeof AudioContext === 'undefined') return () => {}
  const context = new AudioContext()
  const analyser = context.createAnalyser()
  analyser.fftSize = WINDOW_SAMPLES
  context.createMediaStreamSource(stream).connect(analyser)
  void context.resume()
  const samples = new Float32Array(analyser.fftSize)
  const timer = setInterval(() => {
    analyser.getFloatTimeDomainData(samples)
    showLevel(meter, levelDb(samples))
  }, PERIOD_MS)
  return () => {
    clearInterval(timer)
    showLevel(meter, -Infinity)
    void context.close()
  }
}

function showLevel(meter: HTMLElement, db: number): void {
  meter.style.setProperty('--level', meterShare(db).toFixed(3))
  meter.setAttribute('aria-valuenow', String(Math.round(Math.max(QUIET_DB, db))))
}
