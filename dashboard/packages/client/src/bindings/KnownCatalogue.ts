import type { Catalogue, CatalogueEntry } from '@mosaic/protocol'
import { Value, type Readable } from '../platform/Readable'
import { entryFor } from '../words/entryFor'

/**
 * Keeps what is known of a robot's connectors: the server's short form, the full one that a live robot told, or, of a robot
 * that tells nothing, what people described.
 */
export class KnownCatalogue {
  private readonly known = new Value<Catalogue | null>(null)
  private lastAnnounced: Catalogue | null = null
  private told: Catalogue | null = null
  private descriptionOf: Catalogue | null = null
  private readonly isFromPeople = new Value(false)
  private isGreeted = false

  readonly value: Readable<Catalogue | null> = this.known

  entryOf(label: string): CatalogueEntry | null {
    return entryFor(this.known.get(), label)
  }

  /** True where the robot or its server said it. */
  get isTold(): boolean {
    return this.told !== null
  }

  /** True where it is people's word alone: then the robot is taken for an original one. */
  readonly described: Readable<boolean> = this.isFromPeople

  /** The server's word, which counts for less than that of a live robot. */
  announced(catalogue: Catalogue, isLive: boolean): void {
    this.lastAnnounced = catalogue
    if (!isLive) this.fallBack()
  }

  /** The robot's own word. */
  learn(catalogue: Catalogue): void {
    this.told = catalogue
    this.show()
  }

  /** People's word, which counts for least; null: nobody described it. */
  describe(catalogue: Catalogue | null): void {
    this.descriptionOf = catalogue
    this.show()
  }

  /** The robot said hello: it tells its connectors itself. */
  greeted(): void {
    this.isGreeted = true
    this.show()
  }

  /** The robot is gone: the server's word counts again. */
  fallBack(): void {
    this.isGreeted = false
    // With the same hash the full form that we may have says more.
    const announced = this.lastAnnounced
    if (announced && announced.hash !== this.told?.hash) this.told = announced
    this.show()
  }

  private show(): void {
    const described = this.told === null && !this.isGreeted ? this.descriptionOf : null
    this.isFromPeople.set(described !== null)
    this.known.set(this.told ?? described)
  }
}
