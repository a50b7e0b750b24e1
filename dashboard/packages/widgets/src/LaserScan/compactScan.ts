/** MOSAIC's compact form of laser scans (docs/topics/point-cloud-form.md) to the message that scans are shown from. */
import { inflated } from '../clouds/inflated'

const HEADER_BYTES = 56
const MAGIC = 0x4d4c5331 // "MLS1"
const DEFLATED = 1
const INTENSITY = 2

export function isCompactScan(data: ArrayBuffer): boolean {
  return data.byteLength >= 4 && new DataView(data).getUint32(0) === MAGIC
}

/** With the keys of the JSON form; `null` for no return. Rejects what is no compact scan. */
export async function decodeScan(data: ArrayBuffer): Promise<object> {
  if (data.byteLength < HEADER_BYTES || !isCompactScan(data)) throw new Error('not a compact scan')
  const view = new DataView(data)
  const flags = view.getUint8(4)
  const bodyAt = HEADER_BYTES + view.getUint8(5)
  const count = view.getUint16(6)
  const [angleMin = NaN, increment = NaN] = [16, 24].map((at) => view.getFloat64(at))
  const [step = NaN, rangeMin = NaN, rangeMax = NaN, scanTime = NaN] = [32, 36, 40, 44].map((at) => view.getFloat32(at))
  const isSane = [angleMin, increment, step, rangeMin, rangeMax, scanTime].every(Number.isFinite) && step > 0
  if (!isSane || data.byteLength < bodyAt) throw new Error('its header makes no sense')
  const size = count * ((flags & INTENSITY) !== 0 ? 3 : 2)
  const raw = new Uint8Array(data, bodyAt)
  const body = (flags & DEFLATED) !== 0 ? await inflated(raw, size) : raw
  if (body.length !== size) throw new Error('its body has another size than its header says')
  return {
    angle_min: angleMin,
    angle_increment: increment,
    range_min: rangeMin,
    ...(rangeMax > 0 ? { range_max: rangeMax } : {}),
    scan_time: scanTime,
    ranges: rangesOf(body, count, step),
  }
}

function rangesOf(planes: Uint8Array, count: number, stepM: number): (number | null)[] {
  const ranges: (number | null)[] = []
  let steps = 0
  for (let index = 0; index < count; index++) {
    const zigzag = (planes[index] as number) | ((planes[index + count] as number) << 8)
    steps = (steps + ((zigzag >>> 1) ^ -(zigzag & 1))) & 0xffff
    ranges.push(steps === 0 ? null : steps * stepM)
  }
  return ranges
}
