/** Draws the layers of a map. */
import type { Surface } from '../paint/CanvasPainter'
import { paintGrid, pixelsOf, type View } from '../paint/metricGrid'
import { paintPlace, paintWay } from '../paint/paintTrail'
import { pixelsOfGrid, rgbOfHex, type GridMap } from './gridMap'
import type { MapLayer } from './mapLayers'

/** Pictures of grids, each made once per colour scheme: a map comes rarely, and is painted often. */
export class GridPictures {
  private readonly made = new WeakMap<GridMap, { colours: Surface['colours']; picture: HTMLCanvasElement }>()

  pictureOf(grid: GridMap, colours: Surface['colours']): HTMLCanvasElement {
    const known = this.made.get(grid)
    if (known?.colours === colours) return known.picture
    const picture = document.createElement('canvas')
    picture.width = grid.columns
    picture.height = grid.rows
    const pixels = pixelsOfGrid(grid, rgbOfHex(colours.panel), rgbOfHex(colours.text))
    picture.getContext('2d')?.putImageData(new ImageData(pixels, grid.columns, grid.rows), 0, 0)
    this.made.set(grid, { colours, picture })
    return picture
  }
}

export function paintMap(surface: Surface, layers: readonly MapLayer[], view: View, pictures: GridPictures): void {
  const grids = layers.filter((layer) => layer.kind === 'grid')
  if (grids.length > 0) paintUnknown(surface)
  for (const { grid } of grids) paintGridMap(surface, grid, view, pictures.pictureOf(grid, surface.colours))
  surface.context.globalAlpha = grids.length > 0 ? 0.5 : 1 // so that no line cuts a wall
  paintGrid(surface, view)
  surface.context.globalAlpha = 1
  for (const layer of layers) {
    if (layer.kind === 'path') paintPath(surface, layer.places, view)
    if (layer.kind === 'pose') paintPlace(surface, layer.place, view)
  }
}

/** What no cell tells of is unknown, too. */
function paintUnknown({ context, width, height, colours }: Surface): void {
  context.fillStyle = colours.line
  context.fillRect(0, 0, width, height)
}

function paintGridMap(surface: Surface, grid: GridMap, view: View, picture: HTMLCanvasElement): void {
  const { context } = surface
  const { toX, toY } = pixelsOf(surface, view)
  const cellPx = grid.resolutionM * view.scale
  context.save()
  context.imageSmoothingEnabled = false
  context.translate(toX(grid.x), toY(grid.y))
  context.rotate(-grid.yawRad)
  context.drawImage(picture, 0, -grid.rows * cellPx, grid.columns * cellPx, grid.rows * cellPx)
  context.restore()
}

function paintPath(surface: Surface, places: readonly { x: number; y: number }[], view: View): void {
  paintWay(surface, places, view)
  const goal = places.at(-1)
  if (goal === undefined) return
  const { context, colours } = surface
  const { toX, toY } = pixelsOf(surface, view)
  context.fillStyle = colours.accent
  context.beginPath()
  context.arc(toX(goal.x), toY(goal.y), 5, 0, 2 * Math.PI)
  context.fill()
}
