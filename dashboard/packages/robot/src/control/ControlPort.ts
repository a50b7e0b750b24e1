import { controlText, parseControl, WireError, type ControlMessage, type ControlMessages } from '@mosaic/protocol'
import { DataPort, microseconds, type ChannelPartials, type PortMessage } from '@mosaic/client/parts'
import { Pace } from './Pace'

/** Ours come twice a second, a stop on top of them; whoever says more is not read. */
const WORDS_PER_S = 100
const MAX_WORD_BYTES = 256 * 1024

export interface ControlPortListener {
  opened(): void
  /** Null for a word that we don't know, and for a ping, which is answered here. */
  heard(message: ControlMessage | null): void
}

/** Carries control messages on a channel of one operator, `_mosaic` or `_stop`: the robot's end. */
export class ControlPort {
  private readonly port: DataPort
  private readonly pace = new Pace(WORDS_PER_S, 2 * WORDS_PER_S)

  constructor(
    channel: RTCDataChannel,
    private readonly now: () => number,
    partials: ChannelPartials,
    private readonly listener: ControlPortListener,
  ) {
    // Not `latest`, also on the stop channel: a word that waits for room must not look as if it had been sent.
    this.port = new DataPort(
      channel,
      { dataType: 'json-bi', delivery: 'reliable', now, partials },
      {
        opened: () => listener.opened(),
        closed: () => {},
        received: (_port, message) => this.received(message),
        misread: (_port, error) => this.refuse(error),
      },
    )
    if (this.port.isOpen) queueMicrotask(() => listener.opened())
  }

  send<T extends keyof ControlMessages>(type: T, data: ControlMessages[T]): boolean {
    return this.port.send(controlText(type, data))
  }

  close(): void {
    this.port.close()
  }

  private received({ data }: PortMessage): void {
    const arrivedMs = this.now()
    if (!this.pace.admits(arrivedMs)) return
    try {
      if (data.byteLength > MAX_WORD_BYTES) throw new WireError('control channel: message too large')
      const message = parseControl(new TextDecoder().decode(data))
      if (message?.type === 'ping') this.answerPing(message.data.t0, arrivedMs)
      this.listener.heard(message?.type === 'ping' ? null : message)
    } catch (error) {
      if (!(error instanceof WireError)) throw error
      this.refuse(error)
    }
  }

  private answerPing(t0: number, arrivedMs: number): void {
    this.send('pong', { t0, t1: microseconds(arrivedMs), t2: microseconds(this.now()) })
  }

  private refuse(error: WireError): void {
    this.send('refusal', { label: this.port.label, code: 'signal.bad_message', message: error.message })
  }
}
