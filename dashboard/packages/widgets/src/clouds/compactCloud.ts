/** MOSAIC's compact form of point clouds (docs/topics/point-cloud-form.md): header, quantized byte planes, maybe deflated. */
import { CloudError, inflated } from './inflated'

export interface PointCloud {
  count: number
  /** x, y, z of each point in metres, relative to `origin`. */
  positions: Float32Array<ArrayBuffer>
  origin: readonly [number, number, number]
  /** 0 to 255, between `intensityRange`. */
  intensities: Uint8Array<ArrayBuffer> | null
  intensityRange: readonly [number, number]
  /** Red, green, blue of each point. */
  colours: Uint8Array<ArrayBuffer> | null
  frameId: string
  /** The robot's monotonic clock; 0 where it is not known. */
  capturedUs: number
  resolutionM: number
}

interface Header {
  flags: number
  count: number
  planes: number
  bodyAt: number
  cloud: Pick<PointCloud, 'origin' | 'intensityRange' | 'frameId' | 'capturedUs' | 'resolutionM'>
}

const HEADER_BYTES = 60
const MAGIC = 0x4d504331 // "MPC1"
const DEFLATED = 1
const WIDE = 2
const INTENSITY = 4
const COLOUR = 8
/** Larger clouds are refused: they would cost the page hundreds of megabytes. */
const MAX_POINTS = 4_000_000

/** How many points the data announces: a few bytes may unfold to many. */
export function announcedPoints(data: ArrayBuffer): number {
  return data.byteLength < HEADER_BYTES ? 0 : new DataView(data).getUint32(8)
}

export function isCompact(data: ArrayBuffer): boolean {
  return data.byteLength >= 4 && new DataView(data).getUint32(0) === MAGIC
}

export async function decodeCloud(data: ArrayBuffer): Promise<PointCloud> {
  const header = headerOf(data)
  const size = header.planes * header.count
  const raw = new Uint8Array(data, header.bodyAt)
  const body = (header.flags & DEFLATED) !== 0 ? await inflated(raw, size) : raw
  if (body.length !== size) throw new CloudError('its body has another size than its header says')
  return cloudOf(header, body)
}

function headerOf(data: ArrayBuffer): Header {
  if (data.byteLength < HEADER_BYTES) throw new CloudError('shorter than its header')
  const view = new DataView(data)
  if (view.getUint32(0) !== MAGIC) throw new CloudError('not in the compact form, or in another version of it')
  const flags = view.getUint8(4)
  const bodyAt = HEADER_BYTES + view.getUint8(5)
  const count = view.getUint32(8)
  const numbers = [20, 28, 36, 44].map((at) => view.getFloat64(at))
  const [resolutionM = 0, x = 0, y = 0, z = 0] = numbers
  const intensityRange = [view.getFloat32(52), view.getFloat32(56)] as const
  if (count > MAX_POINTS || !(resolutionM > 0) || ![...numbers, ...intensityRange].every(Number.isFinite)) {
    throw new CloudError('its header makes no sense')
  }
  if (data.byteLength < bodyAt) throw new CloudError('shorter than its name')
  const frameId = new TextDecoder().decode(new Uint8Array(data, HEADER_BYTES, bodyAt - HEADER_BYTES))
  const capturedUs = Number(view.getBigUint64(12))
  const planes = 3 * width(flags) + ((flags & INTENSITY) !== 0 ? 1 : 0) + ((flags & COLOUR) !== 0 ? 3 : 0)
  return { flags, count, planes, bodyAt, cloud: { origin: [x, y, z], intensityRange, frameId, capturedUs, resolutionM } }
}

const width = (flags: number): 2 | 4 => ((flags & WIDE) !== 0 ? 4 : 2)

function cloudOf({ flags, count, cloud }: Header, body: Uint8Array<ArrayBuffer>): PointCloud {
  const bytes = width(flags)
  const positions = new Float32Array(3 * count)
  for (let axis = 0; axis < 3; axis++) {
    const planes = body.subarray(axis * bytes * count, (axis + 1) * bytes * count)
    if (bytes === 2) narrowAxis(planes, count, cloud.resolutionM, positions, axis)
    else wideAxis(planes, count, cloud.resolutionM, positions, axis)
  }
  let at = 3 * bytes * count
  let intensities: PointCloud['intensities'] = null
  if ((flags & INTENSITY) !== 0) {
    intensities = body.slice(at, at + count)
    at += count
  }
  const colours = (flags & COLOUR) !== 0 ? colourTriples(body.subarray(at), count) : null
  return { ...cloud, count, positions, intensities, colours }
}

// Two loops that differ in two shifts: one with a loop over bytes inside takes three times as long.
function narrowAxis(planes: Uint8Array, count: number, scale: number, positions: Float32Array, axis: number): void {
  let steps = 0
  for (let index = 0, at = axis; index < count; index++, at += 3) {
    const zigzag = byte(planes, index) | (byte(planes, index + count) << 8)
    steps = (steps + ((zigzag >>> 1) ^ -(zigzag & 1))) & 0xffff
    positions[at] = steps * scale
  }
}

function wideAxis(planes: Uint8Array, count: number, scale: number, positions: Float32Array, axis: number): void {
  let steps = 0
  for (let index = 0, at = axis; index < count; index++, at += 3) {
    const low = byte(planes, index) | (byte(planes, index + count) << 8)
    const zigzag = low | (byte(planes, index + 2 * count) << 16) | (byte(planes, index + 3 * count) << 24)
    steps = (steps + ((zigzag >>> 1) ^ -(zigzag & 1))) >>> 0
    positions[at] = steps * scale
  }
}

function colourTriples(planes: Uint8Array, count: number): Uint8Array<ArrayBuffer> {
  const triples = new Uint8Array(3 * count)
  for (let channel = 0; channel < 3; channel++) {
    let level = 0
    for (let index = 0; index < count; index++) {
      level = (level + byte(planes, channel * count + index)) & 0xff
      triples[3 * index + channel] = level
    }
  }
  return triples
}

// Callers stay within the length that was checked.
function byte(bytes: Uint8Array, index: number): number {
  return bytes[index] as number
}
