import { reasonOf, type SendBlock } from '@mosaic/client'

/** Why nothing leaves the page now, and what to do: somebody else commands, or the robot is stopped. */
export function blockedText({ code, message }: SendBlock): string {
  const { sentence, cure } = reasonOf(code)
  return `${sentence} ${message ?? cure}`.trim()
}
