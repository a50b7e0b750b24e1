/** What the foot of the picture says: how many points, how often, how large, how old. */
import { ageText } from '../stores/age'

const number = new Intl.NumberFormat('en', { maximumFractionDigits: 0 })

export interface CloudFacts {
  points: number
  bytes: number
  rateHz: number | null
  ageMs: number | null
}

export function factsText({ points, bytes, rateHz, ageMs }: CloudFacts): string {
  const parts = [`${number.format(points)} points`]
  if (rateHz !== null) parts.push(`${rateHz.toFixed(1)} Hz`)
  parts.push(sizeText(bytes))
  if (ageMs !== null) parts.push(ageText(ageMs))
  return parts.join(' · ')
}

function sizeText(bytes: number): string {
  if (bytes < 1024) return `${bytes} B`
  const kilobytes = bytes / 1024
  return kilobytes < 1024 ? `${number.format(kilobytes)} KB` : `${(kilobytes / 1024).toFixed(1)} MB`
}

/** Measures clouds per second over the last few seconds. */
export class Rate {
  private readonly arrivedAtMs: number[] = []

  note(nowMs: number): void {
    this.arrivedAtMs.push(nowMs)
    while (this.arrivedAtMs.length > 0 && nowMs - (this.arrivedAtMs[0] as number) > 5000) this.arrivedAtMs.shift()
  }

  get rateHz(): number | null {
    const first = this.arrivedAtMs[0]
    const last = this.arrivedAtMs.at(-1)
    if (first === undefined || last === undefined || last - first < 200) return null
    return ((this.arrivedAtMs.length - 1) * 1000) / (last - first)
  }
}
