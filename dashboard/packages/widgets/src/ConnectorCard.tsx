import { entryFor, nearestName } from '@mosaic/client'
import { useReadable, useRobotConnection } from '@mosaic/react'
import { useState } from 'react'
import frame from './frame/frame.module.css'
import { Notice } from './frame/Notice'
import { Mismatch, WidgetCard } from './frame/WidgetCard'
import { chooseWidget, widgetsFor } from './registry/chooseWidget'
import { widgets } from './widgets'

/** Which connector of which robot a card shows. */
export interface ConnectorCardProps {
  robotId: string
  label: string
}

/**
 * Shows one connector by its label, as the widget that fits it best; its menu offers the others. It fills what is around it,
 * may be there before the robot is, and says when the robot has no such connector.
 */
export function ConnectorCard({ robotId, label }: ConnectorCardProps) {
  const catalogue = useReadable(useRobotConnection(robotId).catalogue)
  const [chosenId, setChosenId] = useState<string>()
  const entry = entryFor(catalogue, label)
  if (entry === null) return <Absent label={label} known={catalogue?.entries.map((one) => one.label) ?? null} />
  const alternatives = widgetsFor(widgets, entry)
  return <WidgetCard {...{ robotId, entry, alternatives }} widget={chooseWidget(widgets, entry, chosenId)} onChoose={setChosenId} />
}

/** `known`: what the robot has instead; null: nobody knows yet. */
function Absent({ label, known }: { label: string; known: readonly string[] | null }) {
  const nearest = nearestName(label, known ?? [])
  return (
    <section className={frame.card} aria-label={label} aria-busy={known === null}>
      {known === null ? (
        <Notice tone="wait" title={`Waiting for ‘${label}’`} />
      ) : (
        <Mismatch label={label} state={nearest === null ? { phase: 'mismatch' } : { phase: 'mismatch', nearest }} />
      )}
    </section>
  )
}
