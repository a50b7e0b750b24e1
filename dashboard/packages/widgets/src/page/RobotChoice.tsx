import { NativeSelect } from '@mantine/core'
import { reasonOf, type RobotSummary } from '@mosaic/client'
import { useConnectedRobot, useReadable, useRobots } from '@mosaic/react'
import { useState, type ReactNode } from 'react'
import { LeaseButtons } from '../control/LeaseButton'
import { LeaseRequests } from '../control/LeaseRequests'
import { StopButton } from '../control/StopButton'
import { StoppedBanner } from '../control/StoppedBanner'
import { Notice } from '../frame/Notice'
import classes from './page.module.css'

/** What is shown of the robot that is chosen. */
export interface RobotChoiceProps {
  children: (robotId: string) => ReactNode
}

/**
 * Lets a person choose one of their robots, an only one by itself, and shows `children` of it while connected to it, with
 * its leases and its stop above.
 */
export function RobotChoice({ children }: RobotChoiceProps) {
  const robots = useRobots()
  const [wantedId, setWantedId] = useState('')
  const only = robots.length === 1 ? robots[0] : undefined
  const robotId = (robots.find(({ id }) => id === wantedId) ?? only)?.id
  return (
    <>
      <header className={classes.header}>
        <NativeSelect aria-label="Robot" value={robotId ?? ''} onChange={(event) => setWantedId(event.currentTarget.value)}>
          {robotId === undefined && <option value="">Choose a robot</option>}
          {robots.map((robot) => (
            <option key={robot.id} value={robot.id}>
              {nameOf(robot)}
            </option>
          ))}
        </NativeSelect>
        {robotId !== undefined && <Controls key={robotId} robotId={robotId} />}
      </header>
      {robots.length === 0 && <Notice tone="wait" title="There is no robot yet" />}
      {robotId !== undefined && (
        <Chosen key={robotId} robotId={robotId}>
          {children(robotId)}
        </Chosen>
      )}
    </>
  )
}

function Chosen({ robotId, children }: { robotId: string; children: ReactNode }) {
  return (
    <>
      <LeaseRequests robotId={robotId} />
      <StoppedBanner robotId={robotId} />
      <main className={classes.board}>{children}</main>
    </>
  )
}

function nameOf({ name, isOnline }: RobotSummary): string {
  return isOnline ? name : `${name} (offline)`
}

function Controls({ robotId }: { robotId: string }) {
  const { phase, code, message } = useReadable(useConnectedRobot(robotId).state)
  const why = code === undefined ? '' : `: ${message ?? reasonOf(code).sentence}`
  return (
    <>
      <span role="status" className={classes.phase}>
        {phase}
        {why}
      </span>
      <div className={classes.controls} role="group" aria-label="Control of the robot">
        <LeaseButtons robotId={robotId} />
        <StopButton robotId={robotId} />
      </div>
    </>
  )
}
