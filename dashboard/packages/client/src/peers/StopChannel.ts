import { controlText, parseControl, WireError, type Stop, type StopAck } from '@mosaic/protocol'
import { microseconds } from '../timing/clock'
import { DataPort } from '../delivery/DataPort'

/** Carries stops and what is said of them on the `_stop` channel of one peer. A robot without it closes it or says nothing there; the control channel serves too. */
export class StopChannel {
  private readonly port: DataPort

  /** `opened` when it can be used, `acknowledged` for every answer, readable ones only. */
  constructor(
    channel: RTCDataChannel,
    private readonly now: () => number,
    private readonly listener: { opened(): void; acknowledged(ack: StopAck): void },
  ) {
    // Not `latest`: a value that waits for room would replace nothing here, and must not look as if it had been sent.
    const options = { dataType: 'json-bi', delivery: 'reliable', now } as const
    this.port = new DataPort(channel, options, {
      opened: () => this.listener.opened(),
      closed: () => {},
      received: (_port, { data }) => this.received(data),
      misread: (_port, error) => warn(error),
    })
  }

  send(stop: Stop): boolean {
    return this.port.send(controlText('stop', stop))
  }

  close(): void {
    this.port.close()
  }

  /** The robot measures the link here, where nothing waits for a lost packet. */
  private answer(t0: number, t1: number): void {
    this.port.send(controlText('pong', { t0, t1, t2: microseconds(this.now()) }))
  }

  private received(data: ArrayBuffer): void {
    const arrivedUs = microseconds(this.now())
    try {
      const message = parseControl(new TextDecoder().decode(data))
      if (message?.type === 'stop.ack') this.listener.acknowledged(message.data)
      if (message?.type === 'ping') this.answer(message.data.t0, arrivedUs)
    } catch (error) {
      if (!(error instanceof WireError)) throw error
      warn(error)
    }
  }
}

function warn(error: WireError): void {
  console.warn(`mosaic: the robot sent something unreadable on its stop channel (${error.message})`)
}
