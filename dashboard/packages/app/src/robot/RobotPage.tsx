import { nearestName, type CatalogueEntry, type RobotConnection, type RobotSummary } from '@mosaic/client'
import { useConnectedRobot, useControl, useMosaicClient, useReadable, useRobots } from '@mosaic/react'
import { Button } from '@mantine/core'
import {
  ControlFrame,
  ControlNews,
  lazyDialog,
  LeaseButtons,
  LeaseRequests,
  Mismatch,
  Notice,
  Presence,
  StopButton,
  StoppedBanner,
  WidgetCard,
  widgets,
} from '@mosaic/widgets'
import { IconChevronLeft, IconListDetails } from '@tabler/icons-react'
import { lazy, Suspense, useEffect, useState, type CSSProperties } from 'react'
import { Link, useParams } from 'react-router-dom'
import { OriginalNotice } from '../describe/OriginalNotice'
import { Shell } from '../shell/Shell'
import { useTitle } from '../shell/useTitle'
import { ConnectionBadge } from './ConnectionBadge'
import { ConnectionNotice } from './ConnectionNotice'
import { placesOf, type CardPlace } from './layout'
import { NearNotice } from './NearNotice'
import { RobotMenu } from './RobotMenu'
import classes from './robot.module.css'
import { useViewChoices, type ViewChoicesControl } from './useViewChoices'
import { strayLabels } from './viewChoices'

const NotDescribed = lazy(() => import('../describe/NotDescribed'))
const DescribeDialog = lazyDialog(() => import('../describe/DescribeDialog'))

export function RobotPage() {
  const { robotId = '' } = useParams()
  // One robot's page never becomes another's: its stores, choices and connection end with it.
  return <OneRobot key={robotId} robotId={robotId} />
}

function OneRobot({ robotId }: { robotId: string }) {
  const robot = useRobot(robotId)
  const connection = useConnectedRobot(robotId)
  const catalogue = useReadable(connection.catalogue)
  const isDescribed = useReadable(connection.isDescribed)
  const views = useViewChoices(robotId)
  useTitle(robot?.name ?? 'Robot')
  return (
    <Shell
      header={
        <>
          <Heading robot={robot} connection={<ConnectionBadge connection={connection} isOnline={robot?.isOnline} />} />
          <Presence robotId={robotId} />
          <div className={classes.controls} role="group" aria-label="Control of the robot">
            <LeaseButtons robotId={robotId} />
            <StopButton robotId={robotId} />
          </div>
        </>
      }
      menu={<RobotMenu robotId={robotId} robot={robot} />}
      notice={
        <>
          <LeaseRequests robotId={robotId} />
          <ControlNews robotId={robotId} />
          <ConnectionNotice connection={connection} robot={robot} />
          <NearNotice connection={connection} />
        </>
      }
    >
      <StoppedBanner robotId={robotId} />
      <OriginalNotice robotId={robotId} />
      {catalogue === null ? (
        <NoCatalogue connection={connection} robot={robot} />
      ) : (
        <Board robotId={robotId} entries={catalogue.entries} views={views} />
      )}
      {isDescribed && robot !== undefined && <DescribeMore robot={robot} />}
      <ControlFrame robotId={robotId} />
    </Shell>
  )
}

function Heading({ robot, connection }: { robot: RobotSummary | undefined; connection: React.ReactNode }) {
  return (
    <>
      <Link className={classes.back} to="/" aria-label="Back to all robots">
        <IconChevronLeft size={18} aria-hidden />
      </Link>
      <h1 className={classes.title}>{robot?.name ?? 'Robot'}</h1>
      {connection}
      <span className={classes.spacer} />
    </>
  )
}

interface BoardProps {
  robotId: string
  entries: readonly CatalogueEntry[]
  views: ViewChoicesControl
}

function Board({ robotId, entries, views }: BoardProps) {
  const labels = entries.map((entry) => entry.label)
  if (entries.length === 0) {
    return (
      <Notice tone="warn" title="The robot has no connectors">
        Add some to its mosaic_config.yaml; `mosaic connectors list` shows what is installed.
      </Notice>
    )
  }
  return (
    <div className={classes.board}>
      {placesOf(entries, widgets, views.choices).map((place) => (
        <PlacedWidget key={place.entry.label} robotId={robotId} place={place} onChoose={views.choose} />
      ))}
      {strayLabels(views.choices, labels).map((label) => (
        <StrayChoice key={label} label={label} labels={labels} views={views} />
      ))}
    </div>
  )
}

interface PlacedWidgetProps {
  robotId: string
  place: CardPlace
  onChoose: ViewChoicesControl['choose']
}

function PlacedWidget({ robotId, place, onChoose }: PlacedWidgetProps) {
  const { entry, widget, alternatives, area, isLeading, columns, rows } = place
  return (
    <div
      className={classes.place}
      data-area={area}
      data-leading={isLeading}
      style={{ '--columns': columns, '--rows': rows } as CSSProperties}
    >
      <WidgetCard
        robotId={robotId}
        entry={entry}
        widget={widget}
        alternatives={alternatives}
        onChoose={(widgetId) => onChoose(entry.label, widgetId)}
      />
    </div>
  )
}

/** A view that was set up for a label which the robot no longer has is said, not dropped. */
function StrayChoice({ label, labels, views }: { label: string; labels: readonly string[]; views: ViewChoicesControl }) {
  const nearest = nearestName(label, labels)
  return (
    <div className={classes.place} data-area="panel" style={{ '--columns': 4, '--rows': 3 } as CSSProperties}>
      <section className={classes.stray} aria-label={`${label}: no such connector`}>
        <Mismatch label={label} state={nearest === null ? { phase: 'mismatch' } : { phase: 'mismatch', nearest }}>
          <span className={classes.strayActions}>
            {nearest !== null && (
              <Button size="compact-sm" variant="default" onClick={() => views.move(label, nearest)}>
                Use it for ‘{nearest}’
              </Button>
            )}
            <Button size="compact-sm" variant="subtle" color="gray" onClick={() => views.forget(label)}>
              Forget
            </Button>
          </span>
        </Mismatch>
      </section>
    </div>
  )
}

interface NoCatalogueProps {
  connection: RobotConnection
  robot: RobotSummary | undefined
}

/** One of ours tells its connectors within a moment; an original one never does. */
function NoCatalogue({ connection, robot }: NoCatalogueProps) {
  const { phase } = useReadable(connection.state)
  const { availability } = useControl(connection.robotId)
  if (availability !== 'unavailable' || robot === undefined) {
    return <div className={classes.board} aria-busy={phase === 'connecting' || phase === 'connected'} />
  }
  return (
    <Suspense>
      <NotDescribed robot={robot} />
    </Suspense>
  )
}

/** The way to the description of a robot that says nothing itself. */
function DescribeMore({ robot }: { robot: RobotSummary }) {
  const [isOpen, setIsOpen] = useState(false)
  return (
    <div className={classes.describe}>
      <span>These connectors were described by people; the robot itself announces nothing.</span>
      <Button size="compact-sm" variant="default" leftSection={<IconListDetails size={16} stroke={1.6} />} onClick={() => setIsOpen(true)}>
        {robot.myRole === 'observer' ? 'See what it has' : 'Change what it has'}
      </Button>
      {isOpen && <DescribeDialog robot={robot} onClose={() => setIsOpen(false)} />}
    </div>
  )
}

function useRobot(robotId: string): RobotSummary | undefined {
  const client = useMosaicClient()
  const robot = useRobots().find((one) => one.id === robotId)
  const isUnknown = robot === undefined
  useEffect(() => {
    // Opened by its address: the list was never shown. What fails here is said by the connection.
    if (isUnknown) client.refreshRobots().catch(() => {})
  }, [client, isUnknown])
  return robot
}
