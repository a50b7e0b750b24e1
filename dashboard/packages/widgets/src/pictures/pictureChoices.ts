/** How a person wants to see a picture, remembered in this browser per robot and label. */

/** `drive`: the newest picture at any price; `inspect`: a smooth one; `auto`: as the robot asks or the browser likes. */
export type Buffering = 'drive' | 'inspect' | 'auto'

export interface PictureChoices {
  buffering: Buffering
  showsDetails: boolean
  /** What connectors mark in the picture. */
  showsMarks: boolean
}

/** Enough to even out a poor network, too much to drive by. */
const INSPECT_MS = 250

const BUFFERINGS: readonly Buffering[] = ['drive', 'inspect', 'auto']
const DEFAULT: PictureChoices = { buffering: 'drive', showsDetails: false, showsMarks: true }

export function bufferTargetMs(buffering: Buffering): number | null {
  return { drive: 0, inspect: INSPECT_MS, auto: null }[buffering]
}

const keyOf = (robotId: string, label: string) => `mosaic.picture.${robotId}.${label}`

export function readPictureChoices(storage: Pick<Storage, 'getItem'>, robotId: string, label: string): PictureChoices {
  try {
    const given = JSON.parse(storage.getItem(keyOf(robotId, label)) ?? '{}') as Partial<PictureChoices> | null
    return {
      buffering: BUFFERINGS.find((one) => one === given?.buffering) ?? DEFAULT.buffering,
      showsDetails: given?.showsDetails === true,
      showsMarks: given?.showsMarks !== false,
    }
  } catch {
    return DEFAULT
  }
}

export function writePictureChoices(storage: Pick<Storage, 'setItem'>, robotId: string, label: string, choices: PictureChoices): void {
  try {
    storage.setItem(keyOf(robotId, label), JSON.stringify(choices))
  } catch {
    // Storage may be full or forbidden: the choice then lasts as long as the page.
  }
}
