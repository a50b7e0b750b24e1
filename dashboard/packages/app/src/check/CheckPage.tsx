import { Button, Loader, Title } from '@mantine/core'
import type { Finding } from '@mosaic/client'
import { IconAlertTriangle, IconCheck, IconMinus, IconRefresh, IconX } from '@tabler/icons-react'
import { CopyButton } from '../shell/CopyButton'
import { Shell } from '../shell/Shell'
import { useTitle } from '../shell/useTitle'
import classes from './check.module.css'
import { findingsJson, groupedFindings, worst } from './groupedFindings'
import { useCheck } from './useCheck'

/** Whether connections can be made from here at all: this browser, the server, ICE. Needs no robot. */
export default function CheckPage() {
  useTitle('Check connection')
  const { findings, isRunning, again } = useCheck()
  return (
    <Shell>
      <div className={classes.page} aria-busy={isRunning} data-testid="check">
        <div className={classes.head}>
          <Title order={1} size="h3">
            Check connection
          </Title>
          <span className={classes.spacer} />
          <CopyButton text={findingsJson(findings)} disabled={isRunning}>
            Copy as JSON
          </CopyButton>
          <Button leftSection={<IconRefresh size={16} aria-hidden />} loading={isRunning} onClick={again}>
            Check again
          </Button>
        </div>
        <Summary findings={findings} isRunning={isRunning} />
        {groupedFindings(findings).map(({ title, findings: found }) => (
          <section key={title} className={classes.group} aria-label={title}>
            <h2>{title}</h2>
            <ul>
              {found.map((finding, place) => (
                <FindingRow key={`${finding.check} ${place}`} finding={finding} />
              ))}
            </ul>
          </section>
        ))}
        <p className={classes.hint}>
          This is the operator’s half. On the robot, <code>mosaic doctor mosaic_config.yaml</code> checks the other one.
        </p>
      </div>
    </Shell>
  )
}

function Summary({ findings, isRunning }: { findings: readonly Finding[]; isRunning: boolean }) {
  const first = worst(findings)
  const text = first === null ? 'Nothing is wrong here.' : `${first.sentence} ${first.cure}`
  return (
    <p className={classes.summary} role="status" data-status={isRunning ? 'running' : (first?.status ?? 'ok')}>
      {isRunning ? (
        <>
          <Loader size={14} /> Looking at browser, server, STUN and TURN …
        </>
      ) : (
        <>
          {first !== null && <strong>What to do first: </strong>}
          {text}
        </>
      )}
    </p>
  )
}

const MARKS = {
  ok: <IconCheck size={16} aria-label="fine" />,
  warn: <IconAlertTriangle size={16} aria-label="warning" />,
  fail: <IconX size={16} aria-label="failed" />,
  skipped: <IconMinus size={16} aria-label="skipped" />,
}

function FindingRow({ finding: { status, sentence, cure, code } }: { finding: Finding }) {
  const isBad = status === 'warn' || status === 'fail'
  return (
    <li className={classes.finding} data-status={status}>
      {MARKS[status]}
      <span>
        {sentence}
        {isBad && <code className={classes.code}>{code}</code>}
        {isBad && cure !== '' && <span className={classes.cure}>{cure}</span>}
      </span>
    </li>
  )
}
