import { messages } from '@mosaic/client'
import fc from 'fast-check'
import { describe, expect, test } from 'vitest'
import { boundsOfGrid, countedCells, gridMapOf, pixelsOfGrid, rgbOfHex } from './gridMap'
import { boundsOfLayers, inFrame, layerOf, layerText } from './mapLayers'

const { Path, OccupancyGrid, Odometry } = messages.SCHEMA_IDS
const GRID = { resolution: 0.5, width: 2, height: 3, origin: { position: { x: -1, y: 2 } }, data: [0, 100, -1, 50, 0, 0] }

describe('a grid', () => {
  test('is read with its corner, its sides and its cells', () => {
    const grid = gridMapOf(GRID)
    expect(grid).toMatchObject({ resolutionM: 0.5, columns: 2, rows: 3, x: -1, y: 2, yawRad: 0 })
    expect(grid && boundsOfGrid(grid)).toEqual({ minX: -1, maxX: 0, minY: 2, maxY: 3.5 })
    expect(grid && countedCells(grid)).toEqual({ free: 3, occupied: 2, unknown: 1 })
  })

  test('that is turned reaches to other places', () => {
    const half = Math.SQRT1_2
    const grid = gridMapOf({ ...GRID, origin: { position: { x: 0, y: 0 }, orientation: { z: half, w: half } } })
    const bounds = grid && boundsOfGrid(grid)
    expect(bounds?.minX).toBeCloseTo(-1.5)
    expect(bounds?.maxY).toBeCloseTo(1)
  })

  test.each([
    null,
    {},
    { ...GRID, data: [0] },
    { ...GRID, width: 0, data: [] },
    { ...GRID, resolution: -1 },
    { ...GRID, width: 1e5, height: 1e5 },
    { ...GRID, origin: {} },
  ])('%j is none', (message) => expect(gridMapOf(message)).toBeNull())

  test('is painted with its first row at the bottom; what is unknown lets the page through', () => {
    const grid = gridMapOf(GRID)
    const pixels = grid && [...pixelsOfGrid(grid, [200, 200, 200], [0, 0, 0])]
    const pixel = (column: number, row: number) => pixels?.slice(4 * ((2 - row) * 2 + column), 4 * ((2 - row) * 2 + column) + 4)
    expect(pixel(0, 0)).toEqual([200, 200, 200, 255])
    expect(pixel(1, 0)).toEqual([0, 0, 0, 255])
    expect(pixel(0, 1)).toEqual([0, 0, 0, 0])
    expect(pixel(1, 1)).toEqual([100, 100, 100, 255])
  })

  test('whatever its cells say, they are counted once each', () => {
    fc.assert(
      fc.property(fc.array(fc.oneof(fc.integer(), fc.constant(null)), { minLength: 6, maxLength: 6 }), (data) => {
        const grid = gridMapOf({ ...GRID, data })
        const counts = grid && countedCells(grid)
        expect(counts && counts.free + counts.occupied + counts.unknown).toBe(6)
      }),
    )
  })

  test('has the colours of the page', () => {
    expect(rgbOfHex('#0b7f8f')).toEqual([11, 127, 143])
    expect(rgbOfHex('none')).toEqual([128, 128, 128])
  })
})

describe('layers', () => {
  const way = layerOf(Path, { poses: [{ position: { x: 0, y: 0 } }, { position: { x: 3, y: 4 } }, { nonsense: true }] })
  const grid = layerOf(OccupancyGrid, GRID)
  const robot = layerOf(Odometry, { position: { x: 9, y: 1 }, frame_id: 'odom' })

  test('are told in words', () => {
    expect(way && layerText(way)).toBe('way of 5.0 m, 2 poses')
    expect(grid && layerText(grid)).toBe('1.0 × 1.5 m: 50 % free, 33 % occupied, 17 % unknown')
    expect(robot && layerText(robot)).toBe('x 9.00 · y 1.00 m')
    expect(layerOf(Path, { poses: [] })).toMatchObject({ kind: 'path', places: [] })
    expect(layerOf(Path, { points: [] })).toBeNull()
    expect(layerOf(Odometry, {})).toBeNull()
  })

  test('of one frame lie over each other, grids below; those of another frame are not shown with them', () => {
    const all = [robot, way, grid].filter((layer) => layer !== null)
    expect(inFrame(all, 'map').map(({ kind }) => kind)).toEqual(['grid', 'path'])
    expect(boundsOfLayers(inFrame(all, 'map'))).toEqual({ minX: -1, maxX: 3, minY: 0, maxY: 4 })
    expect(boundsOfLayers(inFrame(all, 'odom'))).toEqual({ minX: 9, maxX: 9, minY: 1, maxY: 1 })
    expect(boundsOfLayers([])).toBeNull()
  })
})
