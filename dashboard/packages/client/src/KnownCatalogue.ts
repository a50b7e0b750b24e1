import type { Catalogue, CatalogueEntry } from '@mosaic/protocol'
import { Value, type Readable } from './Readable'

/** What is known of a robot's connectors: the server's short form, or the full one that a live robot told. */
export class KnownCatalogue {
  private readonly known = new Value<Catalogue | null>(null)
  private lastAnnounced: Catalogue | null = null

  readonly value: Readable<Catalogue | null> = this.known

  entryOf(label: string): CatalogueEntry | null {
    return this.known.get()?.entries.find((entry) => entry.label === label) ?? null
  }

  /** The server's word, which counts for less than that of a live robot. */
  announced(catalogue: Catalogue, isLive: boolean): void {
    this.lastAnnounced = catalogue
    if (!isLive) this.fallBack()
  }

  /** The robot's own word. */
  learn(catalogue: Catalogue): void {
    this.known.set(catalogue)
  }

  /** The robot is gone: the server's word counts again. */
  fallBack(): void {
    // With the same hash the full form that we may have says more.
    const announced = this.lastAnnounced
    if (announced && announced.hash !== this.known.get()?.hash) this.known.set(announced)
  }
}
