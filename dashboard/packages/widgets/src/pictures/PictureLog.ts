import { MAX_RECORDS, type PictureRecord } from './pictureRecords'

/** Keeps the records of one picture since it is watched, the oldest forgotten first. */
export class PictureLog {
  private readonly kept: PictureRecord[] = []
  /** Its seconds count from here, however often the picture comes anew. */
  readonly beganMs = performance.now()

  add(record: PictureRecord): void {
    this.kept.push(record)
    if (this.kept.length > MAX_RECORDS) this.kept.shift()
  }

  get records(): readonly PictureRecord[] {
    return this.kept
  }
}
