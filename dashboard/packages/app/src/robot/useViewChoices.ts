import { useCallback, useState } from 'react'
import { readChoices, without, writeChoices, type ViewChoices } from './viewChoices'

export interface ViewChoicesControl {
  choices: ViewChoices
  choose: (label: string, widgetId: string) => void
  forget: (label: string) => void
  /** Gives a stray label's choice to the label that was meant. */
  move: (from: string, to: string) => void
}

export function useViewChoices(robotId: string): ViewChoicesControl {
  const [choices, setChoices] = useState(() => readChoices(localStorage, robotId))
  const change = useCallback(
    (next: (choices: ViewChoices) => ViewChoices) =>
      setChoices((before) => {
        const after = next(before)
        writeChoices(localStorage, robotId, after)
        return after
      }),
    [robotId],
  )
  return {
    choices,
    choose: (label, widgetId) => change((before) => ({ ...before, [label]: widgetId })),
    forget: (label) => change((before) => without(before, label)),
    move: (from, to) => change((before) => ({ ...without(before, from), [to]: before[from] ?? '' })),
  }
}
