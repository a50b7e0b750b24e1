/** Commands the base of one robot from this page, until a stop ends that. */
export interface Pad {
  readonly robotId: string
  stop(reason: 'stop-button'): void
}

/** Those on the page now. */
export const pads = new Set<Pad>()

/** Somebody pressed Stop: every pad of this robot ends its hold and says zero by itself, whatever else is under way. */
export function restAllPads(robotId: string): void {
  for (const pad of pads) if (pad.robotId === robotId) pad.stop('stop-button')
}
