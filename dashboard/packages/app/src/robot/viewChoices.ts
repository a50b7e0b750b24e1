/** Which widget a person chose for a connector, remembered in this browser per robot. */

export type ViewChoices = Readonly<Record<string, string>>

export interface ChoiceStorage {
  getItem(key: string): string | null
  setItem(key: string, value: string): void
}

const keyOf = (robotId: string) => `mosaic.views.${robotId}`

export function readChoices(storage: ChoiceStorage, robotId: string): ViewChoices {
  try {
    const value: unknown = JSON.parse(storage.getItem(keyOf(robotId)) ?? '{}')
    if (typeof value !== 'object' || value === null) return {}
    return Object.fromEntries(Object.entries(value).filter((entry): entry is [string, string] => typeof entry[1] === 'string'))
  } catch {
    return {}
  }
}

export function writeChoices(storage: ChoiceStorage, robotId: string, choices: ViewChoices): void {
  try {
    storage.setItem(keyOf(robotId), JSON.stringify(choices))
  } catch {
    // Storage may be full or forbidden: the choice then lasts as long as the page.
  }
}

/** Labels that were chosen for but that the robot no longer has. */
export function strayLabels(choices: ViewChoices, labels: readonly string[]): string[] {
  return Object.keys(choices).filter((label) => !labels.includes(label))
}

export function without(choices: ViewChoices, label: string): ViewChoices {
  return Object.fromEntries(Object.entries(choices).filter(([key]) => key !== label))
}
