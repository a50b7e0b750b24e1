import {
  encodeFrame,
  FrameReader,
  PayloadKind,
  WireError,
  type Delivery,
  type MosaicDataType,
  CHANNEL_PROTOCOL,
  CHUNK_PAYLOAD_BYTES,
} from '@mosaic/protocol'
import { microseconds } from '../timing/clock'
import type { Clearance } from '../control/clearance'
import { Arrivals } from './Arrivals'
import { ChannelPartials } from './ChannelPartials'
import { StoreCounters } from './StoreCounters'
import type { OutgoingStream, StreamPort, WaitingMessage } from '../resume/OutgoingStream'

/** Queued bytes from which a `latest` value waits (and is replaced by a newer one) instead of queueing behind others. */
const LATEST_HIGH_WATER_BYTES = 16 * 1024
/** Queued bytes from which a reliable channel refuses. */
const RELIABLE_HIGH_WATER_BYTES = 1024 * 1024

export interface PortOptions {
  dataType: MosaicDataType
  delivery: Delivery
  now: () => number
  /** Whether a message may leave now, and under which epoch; without it anything may. */
  clearance?: () => Clearance
  /** What sends here and outlives the channel; without it the port sends by itself. */
  stream?: OutgoingStream
  /** Where its store counts. */
  counters?: StoreCounters
  /** Shared by all channels of a connection. */
  partials?: ChannelPartials
}

/** One message: it gets neither younger nor a newer epoch than it was made under, however long it waits. */
interface Outgoing {
  value: Uint8Array | string
  epoch: number
  seq: number
  stampUs: number
  latched?: boolean
}

const FREE: Clearance = { epoch: 0, block: null, leaves: true }

export interface PortMessage {
  data: ArrayBuffer
  seq: number
  stampUs: number
  latched: boolean
}

export interface PortListener {
  opened(port: DataPort): void
  closed(port: DataPort): void
  received(port: DataPort, message: PortMessage): void
  /** Bytes that make no sense; the channel stays usable. */
  misread(port: DataPort, error: WireError): void
}

/**
 * Carries messages over one data channel: frames what is sent and unframes what arrives when its protocol is `mosaic.1`; toward an original
 * robot (empty protocol) payloads travel bare. It applies the delivery: `latest` keeps one waiting value.
 */
export class DataPort implements StreamPort {
  private readonly reader: FrameReader
  private readonly partials: ChannelPartials
  private readonly counters: StoreCounters
  private readonly arrivals: Arrivals
  private readonly isFramed: boolean
  private seq = 0
  private waiting: Outgoing | null = null

  constructor(
    private readonly channel: RTCDataChannel,
    private readonly options: PortOptions,
    private readonly listener: PortListener,
  ) {
    this.isFramed = channel.protocol === CHANNEL_PROTOCOL
    const { counters = new StoreCounters(), partials = new ChannelPartials(options.now), delivery } = options
    this.counters = counters
    this.partials = partials
    this.arrivals = new Arrivals(counters, delivery === 'latest')
    this.reader = new FrameReader({ isLossy: delivery === 'latest', partials: partials.shared })
    partials.opened(this.reader, (count) => (counters.incomplete += count))
    channel.binaryType = 'arraybuffer'
    channel.bufferedAmountLowThreshold = LATEST_HIGH_WATER_BYTES / 2
    channel.onopen = () => this.opened()
    channel.onclose = () => this.gone()
    channel.onmessage = (event: MessageEvent<unknown>) => this.received(event.data)
    channel.onbufferedamountlow = () => this.drained()
  }

  get label(): string {
    return this.channel.label
  }

  get isOpen(): boolean {
    return this.channel.readyState === 'open'
  }

  /** True where data flows towards the robot. */
  get isSendable(): boolean {
    return !this.options.dataType.endsWith('r2u')
  }

  /** What sends here and outlives the channel. */
  get stream(): OutgoingStream | null {
    return this.options.stream ?? null
  }

  /** Numbers that outlive connections are read only from framed channels that lose nothing. */
  get isNumbered(): boolean {
    return this.isFramed && this.options.delivery === 'reliable'
  }

  put({ value, stampUs }: WaitingMessage, seq: number): boolean {
    if (!this.isOpen || this.isFull) return false
    this.seq = seq
    return this.transmit({ value, epoch: 0, seq, stampUs })
  }

  putPlain({ value, stampUs }: WaitingMessage): boolean {
    return this.isOpen && !this.isFull && this.transmit({ value, epoch: 0, seq: this.nextSeq(), stampUs })
  }

  /** Send one message; false when it was not accepted. */
  send(data: string | ArrayBuffer | Uint8Array): boolean {
    const value = data instanceof ArrayBuffer ? new Uint8Array(data) : data
    if (this.stream !== null) return this.stream.send(value)
    const { epoch, leaves } = this.clearance()
    if (!this.isOpen || !leaves) return false
    const message = { value, epoch, seq: this.nextSeq(), stampUs: microseconds(this.options.now()) }
    if (this.options.delivery === 'latest' && this.channel.bufferedAmount > LATEST_HIGH_WATER_BYTES) {
      this.counters.replaced += this.waiting === null ? 0 : 1
      this.waiting = { ...message, value: typeof value === 'string' ? value : value.slice() }
      return true
    }
    this.counters.replaced += this.waiting === null ? 0 : 1
    this.waiting = null
    return !this.isFull && this.transmit(message)
  }

  /** Send what was said before this channel was there, with the time that it had then; false when it was not accepted. */
  repeat(value: Uint8Array, stampUs: number): boolean {
    return this.isOpen && !this.isFull && this.transmit({ value, epoch: 0, seq: this.nextSeq(), stampUs, latched: true })
  }

  /** Close the channel without telling the listener. */
  close(): void {
    this.silence()
    this.channel.close()
  }

  private get isFull(): boolean {
    return this.channel.bufferedAmount > RELIABLE_HIGH_WATER_BYTES
  }

  private opened(): void {
    this.stream?.attach(this)
    this.listener.opened(this)
  }

  private drained(): void {
    this.sendWaiting()
    this.stream?.pump()
  }

  private sendWaiting(): void {
    const { waiting } = this
    this.waiting = null
    if (waiting === null || !this.isOpen) return
    const { epoch, leaves } = this.clearance()
    // What was meant under a lease that has ended is meant no more, whatever is held now.
    if (leaves && epoch === waiting.epoch) this.transmit(waiting)
  }

  private clearance(): Clearance {
    return this.options.clearance?.() ?? FREE
  }

  // Also what never leaves takes a number: the robot tells by the gap that a stall was no pause.
  private nextSeq(): number {
    return (this.seq = (this.seq + 1) >>> 0)
  }

  private transmit(message: Outgoing): boolean {
    const { value } = message
    try {
      if (this.isFramed) this.putFramed(message)
      else this.putBare(value)
      this.counters.gave(typeof value === 'string' ? value.length : value.byteLength)
      return true
    } catch {
      // The browser throws where its queue is full or the message too large for the other side.
      return false
    }
  }

  private putFramed({ value, latched = false, ...header }: Outgoing): void {
    const payload = typeof value === 'string' ? new TextEncoder().encode(value) : value
    const frame = { ...header, kind: this.kindOf(value), payload, latched }
    for (const message of encodeFrame(frame, CHUNK_PAYLOAD_BYTES)) this.channel.send(message)
  }

  private kindOf(value: string | Uint8Array): PayloadKind {
    if (this.options.dataType.startsWith('json')) return PayloadKind.JSON
    if (this.options.dataType.startsWith('string')) return PayloadKind.STRING
    return typeof value === 'string' ? PayloadKind.STRING : PayloadKind.BYTES
  }

  // Original robots read JSON and strings from text frames.
  private putBare(value: string | Uint8Array): void {
    if (typeof value === 'string') this.channel.send(value)
    else if (this.options.dataType.startsWith('byte')) this.channel.send(value.slice())
    else this.channel.send(new TextDecoder().decode(value))
  }

  private received(data: unknown): void {
    if (typeof data === 'string') this.tellBare(new TextEncoder().encode(data).buffer)
    else if (data instanceof ArrayBuffer) {
      if (this.isFramed) this.readFramed(data)
      else this.tellBare(data)
    }
  }

  private tellBare(data: ArrayBuffer): void {
    this.counters.got(data.byteLength)
    this.listener.received(this, { data, seq: 0, stampUs: 0, latched: false })
  }

  private readFramed(data: ArrayBuffer): void {
    try {
      const frame = this.reader.read(new Uint8Array(data), this.options.now())
      if (frame === null) return this.partials.arrived()
      const { seq, stampUs, latched } = frame
      this.counters.got(frame.payload.byteLength)
      if (!this.arrivals.take(seq)) return
      this.listener.received(this, { data: exact(frame.payload), seq, stampUs, latched })
    } catch (error) {
      if (!(error instanceof WireError)) throw error
      this.listener.misread(this, error)
    }
  }

  private gone(): void {
    this.silence()
    this.stream?.detach()
    this.listener.closed(this)
  }

  private silence(): void {
    this.waiting = null
    this.partials.closed(this.reader)
    this.channel.onopen = this.channel.onclose = this.channel.onmessage = this.channel.onbufferedamountlow = null
  }
}

function exact(bytes: Uint8Array): ArrayBuffer {
  return bytes.slice().buffer
}
