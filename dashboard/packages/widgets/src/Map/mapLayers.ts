/** What a map shows: the newest message of each connector, in one frame. Pure. */
import { messages } from '@mosaic/client'
import { placeOfPose } from '../PoseTrail/pose'
import { isObject } from '../schema/jsonSchema'
import type { Bounds, Place } from '../paint/Trail'
import { boundsOfGrid, countedCells, gridMapOf, type GridMap } from './gridMap'

export type MapLayer =
  | { kind: 'grid'; frameId: string; grid: GridMap }
  | { kind: 'path'; frameId: string; places: readonly Place[] }
  | { kind: 'pose'; frameId: string; place: Place }

const { Path, OccupancyGrid, Pose, Odometry } = messages.SCHEMA_IDS

/** The messages that a map can show together. */
export const ON_MAPS: readonly string[] = [OccupancyGrid, Path, Pose, Odometry]

/** Where a message says nothing of its frame, its numbers are in the world-fixed one. */
const WORLD = 'map'

/** Null for a message that shows nothing. */
export function layerOf(schemaId: string | undefined, message: unknown): MapLayer | null {
  const frameId = isObject(message) && typeof message['frame_id'] === 'string' && message['frame_id'] !== '' ? message['frame_id'] : WORLD
  if (schemaId === Pose || schemaId === Odometry) {
    const place = placeOfPose(message)
    return place === null ? null : { kind: 'pose', frameId, place }
  }
  const grid = gridMapOf(message)
  if (grid !== null) return { kind: 'grid', frameId, grid }
  if (!isObject(message) || !Array.isArray(message['poses'])) return null
  const places = (message['poses'] as unknown[]).map(placeOfPose).filter((place) => place !== null)
  return { kind: 'path', frameId, places }
}

const ORDER = { grid: 0, path: 1, pose: 2 }

/** Those of the frame, what covers others first. */
export function inFrame(layers: Iterable<MapLayer>, frameId: string): MapLayer[] {
  return [...layers].filter((layer) => layer.frameId === frameId).sort((one, other) => ORDER[one.kind] - ORDER[other.kind])
}

/** Null where there is nothing to see. */
export function boundsOfLayers(layers: readonly MapLayer[]): Bounds | null {
  const all = layers.flatMap((layer) => (layer.kind === 'grid' ? [boundsOfGrid(layer.grid)] : placesOf(layer).map(boundsOfPlace)))
  const [first, ...others] = all
  if (first === undefined) return null
  return others.reduce(
    (bounds, { minX, minY, maxX, maxY }) => ({
      minX: Math.min(bounds.minX, minX),
      minY: Math.min(bounds.minY, minY),
      maxX: Math.max(bounds.maxX, maxX),
      maxY: Math.max(bounds.maxY, maxY),
    }),
    first,
  )
}

function placesOf(layer: Exclude<MapLayer, { kind: 'grid' }>): readonly Place[] {
  return layer.kind === 'path' ? layer.places : [layer.place]
}

function boundsOfPlace({ x, y }: Place): Bounds {
  return { minX: x, maxX: x, minY: y, maxY: y }
}

/** What a connector shows, in words. */
export function layerText(layer: MapLayer): string {
  switch (layer.kind) {
    case 'grid': {
      const { columns, rows, resolutionM } = layer.grid
      const { free, occupied, unknown } = countedCells(layer.grid)
      const share = (cells: number) => `${Math.round((100 * cells) / (columns * rows))} %`
      return `${(columns * resolutionM).toFixed(1)} × ${(rows * resolutionM).toFixed(1)} m: ${share(free)} free, ${share(occupied)} occupied, ${share(unknown)} unknown`
    }
    case 'path':
      return layer.places.length === 0 ? 'no way' : `way of ${lengthM(layer.places).toFixed(1)} m, ${layer.places.length} poses`
    case 'pose':
      return `x ${layer.place.x.toFixed(2)} · y ${layer.place.y.toFixed(2)} m`
  }
}

function lengthM(places: readonly Place[]): number {
  return places.reduce((sum, { x, y }, index) => {
    const before = places[index - 1]
    return before === undefined ? sum : sum + Math.hypot(x - before.x, y - before.y)
  }, 0)
}
