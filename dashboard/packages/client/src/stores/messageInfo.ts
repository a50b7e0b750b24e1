/**
 * What a subscriber is told beside the bytes. The age is read from the clocks whenever somebody asks: they are compared
 * after the first values have arrived.
 */
import type { ClockOffset } from '../timing/ClockOffset'
import type { MessageInfo } from '../words/types'

/** Compares this page's clock with the robot's. */
export type RobotClock = Pick<ClockOffset, 'ageMs'>

/** `clock`: that of the connection on which it arrived; null where nobody knows. */
export function arrived(message: Omit<MessageInfo, 'ageMs'>, clock: RobotClock | null): MessageInfo {
  const { stampUs, receivedAtMs } = message
  return {
    ...message,
    get ageMs() {
      return stampUs === 0 ? null : (clock?.ageMs(stampUs, receivedAtMs) ?? null)
    },
  }
}

/** The same message, for whoever came later. */
export function repeated(info: MessageInfo): MessageInfo {
  return {
    ...info,
    latched: true,
    get ageMs() {
      return info.ageMs
    },
  }
}
