import {
  CONTROL_EXTENSIONS,
  CONTROL_PROTOCOL_VERSION,
  controlText,
  parseControl,
  WireError,
  type ControlMessage,
  type ControlMessages,
  type MediaOrigin,
  type Resume,
} from '@mosaic/protocol'
import { ClockOffset } from '../timing/ClockOffset'
import { microseconds } from '../timing/clock'
import { DataPort, type PortMessage } from '../delivery/DataPort'
import { randomId } from '../platform/randomId'

/** Names this page's clock, like a robot's boot id names the robot's. */
const PAGE_BOOT_ID = randomId()
const SOFTWARE = 'mosaic-dashboard/0.1.0'
const RTP_HZ = 90_000
const TWO_32 = 2 ** 32
/** Display times are told a frame ahead, and clocks compared to half a round trip: more is another clock's picture. */
const FUTURE_TOLERANCE_US = 250_000

export interface ControlListener {
  controlOpened(): void
  controlClosed(): void
  controlHeard(message: ControlMessage | null): void
}

/** Carries messages there and back on the `_mosaic` channel of one peer, and compares the two clocks by its pings. */
export class ControlChannel {
  readonly clocks = new ClockOffset()
  private readonly port: DataPort

  constructor(
    channel: RTCDataChannel,
    private readonly now: () => number,
    private readonly listener: ControlListener,
  ) {
    this.port = new DataPort(
      channel,
      { dataType: 'json-bi', delivery: 'reliable', now },
      {
        opened: () => this.listener.controlOpened(),
        closed: () => this.listener.controlClosed(),
        received: (_port, message) => this.received(message),
        misread: (_port, error) => warn(error),
      },
    )
  }

  send<T extends keyof ControlMessages>(type: T, data: ControlMessages[T]): boolean {
    return this.port.send(controlText(type, data))
  }

  /** The first words: who we are, and how far the reliable channels are. */
  sendHello(word: Resume): void {
    this.send('hello', {
      protocol: CONTROL_PROTOCOL_VERSION,
      extensions: CONTROL_EXTENSIONS,
      software: SOFTWARE,
      bootId: PAGE_BOOT_ID,
      isPerson: true,
    })
    this.send('resume', word)
  }

  sendPing(): void {
    this.send('ping', { t0: microseconds(this.now()) })
  }

  close(): void {
    this.port.close()
  }

  /** See `MediaStreamStore.pictureAgeMs`. */
  pictureAgeMs(rtpTimestamp: number, atMs: number, origin: MediaOrigin): number | null {
    const { offsetUs } = this.clocks
    return offsetUs === null ? null : ageUs(rtpTimestamp, microseconds(atMs) + offsetUs, origin) / 1000
  }

  /**
   * When that picture was captured, on the robot's clock. The offset only chooses among the laps of the RTP clock, so
   * the result is as exact as the robot's own stamp. Null also for a picture of the future: its origin is not known yet.
   */
  captureUs(rtpTimestamp: number, atMs: number, origin: MediaOrigin): number | null {
    const { offsetUs } = this.clocks
    if (offsetUs === null) return null
    const robotUs = microseconds(atMs) + offsetUs
    const pictureUs = ageUs(rtpTimestamp, robotUs, origin)
    return pictureUs < -FUTURE_TOLERANCE_US ? null : Math.max(0, Math.round(robotUs - pictureUs))
  }

  private received({ data }: PortMessage): void {
    const t3 = microseconds(this.now())
    try {
      const message = parseControl(new TextDecoder().decode(data))
      if (message?.type === 'pong') this.clocks.add(message.data.t0, message.data.t1, message.data.t2, t3)
      if (message?.type === 'ping') this.send('pong', { t0: message.data.t0, t1: t3, t2: microseconds(this.now()) })
      this.listener.controlHeard(message)
    } catch (error) {
      if (!(error instanceof WireError)) throw error
      warn(error)
    }
  }
}

function ageUs(rtpTimestamp: number, robotUs: number, origin: MediaOrigin): number {
  const rtpNow = (robotUs * RTP_HZ) / 1_000_000 + origin.rtpOrigin
  return (differenceMod32(rtpNow, rtpTimestamp) / RTP_HZ) * 1_000_000
}

// RTP timestamps wrap after 13 hours; the nearer of the two directions is meant.
function differenceMod32(a: number, b: number): number {
  const difference = (((a - b) % TWO_32) + TWO_32) % TWO_32
  return difference < TWO_32 / 2 ? difference : difference - TWO_32
}

function warn(error: WireError): void {
  console.warn(`mosaic: the robot sent something unreadable on its control channel (${error.message})`)
}
