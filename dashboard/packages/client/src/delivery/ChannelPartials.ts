import { Partials, type FrameReader } from '@mosaic/protocol'

/** Clocks of timers are coarse. */
const PERIOD_MS = 1000

/** Bounds what the robot has sent in part, over all channels of a connection, and forgets it though nothing else arrives. */
export class ChannelPartials {
  readonly shared = new Partials()
  private readonly readers = new Map<FrameReader, (count: number) => void>()
  private timer: ReturnType<typeof setTimeout> | null = null

  constructor(private readonly now: () => number) {}

  /** `forgotten` hears how many messages of this channel will not become whole. */
  opened(reader: FrameReader, forgotten: (count: number) => void): void {
    this.readers.set(reader, forgotten)
  }

  closed(reader: FrameReader): void {
    reader.chunks.close()
    this.readers.delete(reader)
  }

  /** A channel has read something that was no whole message. */
  arrived(): void {
    this.tell()
    if (this.timer === null && this.shared.sizeBytes > 0) this.timer = setTimeout(() => this.expire(), PERIOD_MS)
  }

  private expire(): void {
    this.timer = null
    this.shared.expire(this.now())
    this.arrived()
  }

  private tell(): void {
    for (const [reader, forgotten] of this.readers) {
      const count = reader.chunks.takeForgotten().length
      if (count > 0) forgotten(count)
    }
  }
}
