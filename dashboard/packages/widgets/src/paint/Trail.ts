/** Keeps where something has been: points far enough apart to be told apart, and never more than a screen can show. */

export interface Place {
  x: number
  y: number
  /** Counter-clockwise from x; null where it is not known. */
  headingRad: number | null
}

export interface Bounds {
  minX: number
  minY: number
  maxX: number
  maxY: number
}

const MAX_POINTS = 4000

export class Trail {
  private places: Place[] = []
  private newest: Place | null = null

  constructor(private readonly stepM = 0.02) {}

  add(place: Place): void {
    if (!Number.isFinite(place.x) || !Number.isFinite(place.y)) return
    this.newest = place
    const last = this.places.at(-1)
    if (last !== undefined && Math.hypot(place.x - last.x, place.y - last.y) < this.stepM) return
    this.places.push(place)
    // Half as dense rather than half as long: the whole way stays in sight.
    if (this.places.length > MAX_POINTS) this.places = this.places.filter((_, index) => index % 2 === 0)
  }

  clear(): void {
    this.places = this.newest === null ? [] : [this.newest]
  }

  get points(): readonly Place[] {
    return this.places
  }

  get last(): Place | null {
    return this.newest
  }

  lengthM(): number {
    return this.places.reduce((sum, place, index) => {
      const before = this.places[index - 1]
      return before === undefined ? sum : sum + Math.hypot(place.x - before.x, place.y - before.y)
    }, 0)
  }

  bounds(): Bounds | null {
    if (this.newest === null) return null
    const all = [...this.places, this.newest]
    return all.reduce(
      (bounds, { x, y }) => ({
        minX: Math.min(bounds.minX, x),
        minY: Math.min(bounds.minY, y),
        maxX: Math.max(bounds.maxX, x),
        maxY: Math.max(bounds.maxY, y),
      }),
      { minX: Infinity, minY: Infinity, maxX: -Infinity, maxY: -Infinity },
    )
  }
}
