import { nowMs } from '@mosaic/client'
import { useEffect, useState } from 'react'
import { Notice } from '../frame/Notice'
import type { WidgetProps } from '../registry/WidgetDefinition'
import { exactAge } from '../stores/age'
import { useEveryJson } from '../stores/useReceived'
import { isSilent, keyOfPart, levelNow, partReportOf, summaryText, withReport, worstFirst, type PartReport } from './diagnostics'
import classes from './Diagnostics.module.css'

/** How often what is silent is looked for. */
const PERIOD_MS = 1000

/** How the parts of the robot are, the worst first. */
export function Diagnostics({ entry, store }: WidgetProps) {
  const [parts, setParts] = useState<ReadonlyMap<string, PartReport>>(new Map())
  const now = useNow()
  useEveryJson(store, (message, info) => {
    const report = partReportOf(message, info?.receivedAtMs ?? nowMs())
    if (report !== null) setParts((before) => withReport(before, report))
  })
  if (parts.size === 0) return <Notice tone="wait" title="No part has reported yet" />
  return (
    <div className={classes.root}>
      <div className={classes.summary} role="status">
        {summaryText(parts.values(), now)}
      </div>
      <ul className={classes.parts} aria-label={`Parts of ${entry.label}`}>
        {worstFirst(parts.values(), now).map((report) => (
          <Part key={keyOfPart(report)} report={report} now={now} />
        ))}
      </ul>
    </div>
  )
}

function Part({ report, now }: { report: PartReport; now: number }) {
  const { name, hardwareId, message, values } = report
  const level = levelNow(report, now)
  const silence = isSilent(report, now) ? `not heard for ${exactAge(now - report.heardAtMs)}` : ''
  const head = (
    <>
      <span className={classes.level}>{level}</span>
      <strong>{name}</strong>
      {hardwareId !== '' && <span className={classes.faint}>{hardwareId}</span>}
      <span className={classes.message}>{[message, silence].filter(Boolean).join(' · ')}</span>
    </>
  )
  return (
    <li data-level={level}>
      {values.length === 0 ? (
        <div className={classes.head}>{head}</div>
      ) : (
        <details>
          <summary className={classes.head}>{head}</summary>
          <dl className={classes.values}>
            {values.map(([key, value]) => (
              <div key={key}>
                <dt>{key}</dt>
                <dd>{value}</dd>
              </div>
            ))}
          </dl>
        </details>
      )}
    </li>
  )
}

function useNow(): number {
  const [now, setNow] = useState(nowMs)
  useEffect(() => {
    const timer = setInterval(() => setNow(nowMs()), PERIOD_MS)
    return () => clearInterval(timer)
  }, [])
  return now
}
