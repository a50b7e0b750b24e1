/** Point clouds of original robots: a Meta message and Chunk messages in protobuf, gathered to whole clouds. */
import type { PointCloud } from './compactCloud'
import { CloudError } from './inflated'
import { fieldsOf, type Fields } from './protobuf'

/** Field numbers of the Meta message. Robots from before `expected_chunk_num` have their point fields in its place. */
const META = { timestamp: 1, frameId: 2, height: 3, width: 4, isBigEndian: 5, pointStep: 6, chunkCount: 15, pointFields: 16 }
const CHUNK = { frameId: 2, index: 3, points: 4, data: 5 }
const POINT_FIELD = { name: 1, offset: 2, datatype: 3 }
/** sensor_msgs/PointField.FLOAT32: the only one in which original dashboards read coordinates. */
const FLOAT32 = 7
const MAX_POINT_STEP = 1024
const MAX_POINTS = 4_000_000

interface Meta {
  frameId: string
  pointStep: number
  /** All points, as far as they are finite: robots leave the others out. */
  pointCount: number
  /** Shown from so many chunks on: robots announce one less than they send where the last one is not full. */
  enoughChunks: number
  isLittleEndian: boolean
  offsets: ReadonlyMap<string, number>
}

/** Takes the messages of one connector, whichever of its channels they came on. */
export class OriginalClouds {
  /** How many clouds began. */
  begun = 0
  /** Of the messages of the newest cloud so far. */
  sizeBytes = 0
  private meta: Meta | null = null
  private chunks = new Map<number, Uint8Array<ArrayBuffer>>()

  /** The cloud, as far as it is there, if enough of it has come. Raises `CloudError` for what is neither Meta nor Chunk. */
  take(data: ArrayBuffer): PointCloud | null {
    const fields = fieldsOf(new Uint8Array(data))
    if (fields.bytes(META.pointFields).length > 0 || fields.bytes(META.chunkCount).length > 0) {
      this.meta = metaOf(fields)
      this.chunks.clear()
      this.begun++
      this.sizeBytes = data.byteLength
      return null
    }
    if (fields.bytes(CHUNK.frameId).length === 0) throw new CloudError('neither compact nor of an original robot')
    this.sizeBytes += data.byteLength
    return this.meta !== null && fields.text(CHUNK.frameId) === this.meta.frameId ? this.add(fields, this.meta) : null
  }

  private add(fields: Fields, meta: Meta): PointCloud | null {
    const points = fields.bytes(CHUNK.data)[0] ?? new Uint8Array()
    if (points.length % meta.pointStep !== 0) throw new CloudError('a chunk ends within a point')
    this.chunks.set(fields.number(CHUNK.index), points)
    const count = [...this.chunks.values()].reduce((sum, chunk) => sum + chunk.length, 0) / meta.pointStep
    if (count > MAX_POINTS) throw new CloudError('more points than a page can hold')
    const isEnough = this.chunks.size >= meta.enoughChunks || count >= meta.pointCount
    return isEnough && points.length > 0 ? cloudOf(meta, [...this.chunks.values()], count) : null
  }
}

function metaOf(fields: Fields): Meta {
  const isOlder = fields.bytes(META.pointFields).length === 0
  const described = fields.bytes(isOlder ? META.chunkCount : META.pointFields).map(fieldsOf)
  const offsets = new Map(
    described
      .filter((field) => field.number(POINT_FIELD.datatype) === FLOAT32)
      .map((field) => [field.text(POINT_FIELD.name), field.number(POINT_FIELD.offset)]),
  )
  const pointStep = fields.number(META.pointStep)
  const fits = ['x', 'y', 'z'].every((axis) => (offsets.get(axis) ?? Infinity) + 4 <= pointStep)
  if (pointStep > MAX_POINT_STEP || !fits) throw new CloudError('its points have no x, y and z as 32-bit floats')
  return {
    frameId: fields.text(META.frameId),
    pointStep,
    pointCount: fields.number(META.height) * fields.number(META.width),
    enoughChunks: isOlder ? Infinity : fields.number(META.chunkCount) - 1,
    isLittleEndian: fields.number(META.isBigEndian) === 0,
    offsets,
  }
}

function cloudOf(meta: Meta, chunks: readonly Uint8Array<ArrayBuffer>[], count: number): PointCloud {
  const positions = new Float32Array(3 * count)
  ;['x', 'y', 'z'].forEach((axis, at) => spread(meta, chunks, axis, positions, at, 3))
  const levels = meta.offsets.has('intensity') ? new Float32Array(count) : null
  if (levels !== null) spread(meta, chunks, 'intensity', levels, 0, 1)
  const range = levels === null ? ([0, 0] as const) : rangeOf(levels)
  return {
    count,
    positions,
    origin: [0, 0, 0],
    intensities: levels === null ? null : shares(levels, range),
    intensityRange: range,
    colours: null,
    frameId: '',
    capturedUs: 0,
    resolutionM: 0.001,
  }
}

/** Writes one field of all points to every `stride`-th place of `into`, beginning at `first`. */
function spread(meta: Meta, chunks: readonly Uint8Array<ArrayBuffer>[], field: string, into: Float32Array, first: number, stride: number): void {
  let place = first
  for (const chunk of chunks) {
    const view = new DataView(chunk.buffer, chunk.byteOffset, chunk.byteLength)
    for (let at = meta.offsets.get(field) ?? 0; at + 4 <= chunk.byteLength; at += meta.pointStep, place += stride) {
      into[place] = view.getFloat32(at, meta.isLittleEndian)
    }
  }
}

function rangeOf(levels: Float32Array): readonly [number, number] {
  let [low, high] = [Infinity, -Infinity]
  for (const level of levels) {
    if (level < low) low = level
    if (level > high) high = level
  }
  return low <= high ? [low, high] : [0, 0]
}

function shares(levels: Float32Array, [low, high]: readonly [number, number]): Uint8Array<ArrayBuffer> {
  const scale = high > low ? 255 / (high - low) : 0
  return Uint8Array.from(levels, (level) => Math.round((level - low) * scale))
}
