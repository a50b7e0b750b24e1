/** Decodes clouds one after the other, large ones in a worker; while it is busy only the newest of the others waits. */
import { announcedPoints, decodeCloud, type PointCloud } from '../clouds/compactCloud'

export type DecodedCloud = { id: number; cloud: PointCloud } | { id: number; problem: string }

/** What of a `Worker` is needed; `onerror` also tells of one that a strict policy forbids. */
export type DecoderWorker = Pick<Worker, 'postMessage' | 'onmessage' | 'onerror' | 'terminate'>

/** Below this, decoding takes less time than a worker's answer. */
const WORKER_FROM_POINTS = 5000

export class CloudDecoder<Tag> {
  private worker: DecoderWorker | null | undefined
  private waiting: { data: ArrayBuffer; tag: Tag } | null = null
  private current: { id: number; data: ArrayBuffer; tag: Tag } | null = null
  private lastId = 0
  private isDisposed = false

  constructor(
    private readonly onCloud: (cloud: PointCloud, tag: Tag) => void,
    private readonly onProblem: (problem: string) => void,
    private readonly makeWorker: () => DecoderWorker = () =>
      new Worker(new URL('./cloud.worker.ts', import.meta.url), { type: 'module' }),
  ) {}

  take(data: ArrayBuffer, tag: Tag): void {
    if (this.current !== null) this.waiting = { data, tag }
    else this.begin(data, tag)
  }

  dispose(): void {
    this.isDisposed = true
    this.worker?.terminate()
  }

  private begin(data: ArrayBuffer, tag: Tag): void {
    const id = ++this.lastId
    this.current = { id, data, tag }
    const worker = announcedPoints(data) >= WORKER_FROM_POINTS ? this.ready() : null
    if (worker !== null) worker.postMessage({ id, data })
    else this.decodeHere(id, data)
  }

  private decodeHere(id: number, data: ArrayBuffer): void {
    decodeCloud(data).then(
      (cloud) => this.finish({ id, cloud }),
      (error: unknown) => this.finish({ id, problem: error instanceof Error ? error.message : String(error) }),
    )
  }

  private ready(): DecoderWorker | null {
    if (this.worker !== undefined) return this.worker
    try {
      this.worker = this.makeWorker()
      this.worker.onmessage = (event: MessageEvent<DecodedCloud>) => this.finish(event.data)
      this.worker.onerror = () => this.withoutWorker()
    } catch {
      this.worker = null
    }
    return this.worker
  }

  private withoutWorker(): void {
    this.worker?.terminate()
    this.worker = null
    if (this.current !== null) this.decodeHere(this.current.id, this.current.data)
  }

  private finish(decoded: DecodedCloud): void {
    const { current } = this
    if (this.isDisposed || current === null || decoded.id !== current.id) return
    this.current = null
    const next = this.waiting
    this.waiting = null
    if (next !== null) this.begin(next.data, next.tag)
    if ('cloud' in decoded) this.onCloud(decoded.cloud, current.tag)
    else this.onProblem(decoded.problem)
  }
}
