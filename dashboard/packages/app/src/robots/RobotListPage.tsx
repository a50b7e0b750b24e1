import { Button, Code, Skeleton, Text, TextInput, Title } from '@mantine/core'
import type { RobotSummary } from '@mosaic/client'
import { useMosaicClient, useReadable, useRobots } from '@mosaic/react'
import { type Failure, failureOf, lazyDialog } from '@mosaic/widgets'
import { IconChevronRight, IconDeviceMobile, IconPlus, IconRefresh, IconRobot, IconSearch, IconStethoscope } from '@tabler/icons-react'
import { useCallback, useEffect, useState } from 'react'
import { Link } from 'react-router-dom'
import { Shell } from '../shell/Shell'
import { useServerAway } from '../shell/useServerAway'
import { useTitle } from '../shell/useTitle'
import { foundRobots, presenceOf, type Presence } from './presence'
import classes from './robots.module.css'

const AddRobotDialog = lazyDialog(() => import('./AddRobotDialog'))
const SharePhoneDialog = lazyDialog(() => import('./SharePhoneDialog'))

export interface RobotListPageProps {
  /** Is called once there is a robot to choose: its page is then there when somebody does. */
  fetchRobotPage: () => Promise<unknown>
}

/** All robots of the account with their live status. */
export function RobotListPage({ fetchRobotPage }: RobotListPageProps) {
  useTitle('Robots')
  const robots = useRobots()
  useSoon(fetchRobotPage, robots.length > 0)
  const { isLoading, failure, refresh } = useRefresh()
  const [search, setSearch] = useState('')
  const [isAdding, setIsAdding] = useState(false)
  const [isSharing, setIsSharing] = useState(false)
  const found = foundRobots(robots, search)
  const isServerAway = useServerAway()
  const mayAdd = useReadable(useMosaicClient().session)?.user.isOrganizationAdmin === true
  return (
    <Shell>
      <div className={classes.page}>
        <div className={classes.head}>
          <div className={classes.titles}>
            <Title order={1} size="h3">
              Robots
            </Title>
            <Text c="dimmed" size="sm" aria-live="polite">
              {isServerAway ? ' ' : summary(robots)}
            </Text>
          </div>
          <TextInput
            className={classes.search}
            type="search"
            aria-label="Search robots"
            placeholder="Search"
            leftSection={<IconSearch size={16} />}
            value={search}
            onChange={(event) => setSearch(event.currentTarget.value)}
          />
          <Button component={Link} to="/check" variant="default" leftSection={<IconStethoscope size={16} />}>
            Check connection
          </Button>
          {mayAdd && (
            <>
              <Button variant="default" leftSection={<IconDeviceMobile size={16} />} onClick={() => setIsSharing(true)}>
                Use a phone
              </Button>
              <Button leftSection={<IconPlus size={16} />} onClick={() => setIsAdding(true)}>
                Add robot
              </Button>
            </>
          )}
        </div>
        {failure !== null && robots.length === 0 ? (
          <LoadFailure failure={failure} onRetry={refresh} />
        ) : isLoading && robots.length === 0 ? (
          <Loading />
        ) : robots.length === 0 ? (
          <NoRobots mayAdd={mayAdd} />
        ) : found.length === 0 ? (
          <Text c="dimmed" py="xl" ta="center">
            No robot matches “{search}”.
          </Text>
        ) : (
          <ul className={classes.list} aria-label="Robots">
            {found.map((robot) => (
              <RobotRow key={robot.id} robot={robot} presence={presenceOf(robot, isServerAway)} />
            ))}
          </ul>
        )}
      </div>
      {isAdding && <AddRobotDialog onClose={() => setIsAdding(false)} />}
      {isSharing && <SharePhoneDialog onClose={() => setIsSharing(false)} />}
    </Shell>
  )
}

function RobotRow({ robot, presence }: { robot: RobotSummary; presence: Presence }) {
  return (
    <li>
      <Link className={classes.row} to={`/robots/${encodeURIComponent(robot.id)}`}>
        <span className={classes.icon} data-presence={presence.kind}>
          <IconRobot size={22} stroke={1.5} aria-hidden />
        </span>
        <span className={classes.names}>
          <span className={classes.name}>{robot.name}</span>
          <span className={classes.description}>{robot.description || robot.id}</span>
        </span>
        <span className={classes.presence} data-presence={presence.kind}>
          {presence.text}
        </span>
        <IconChevronRight size={18} aria-hidden className={classes.chevron} />
      </Link>
    </li>
  )
}

function NoRobots({ mayAdd }: { mayAdd: boolean }) {
  return (
    <div className={classes.empty}>
      <IconRobot size={36} stroke={1.3} aria-hidden />
      <Title order={2} size="h4">
        No robots yet
      </Title>
      <Text c="dimmed" size="sm">
        {mayAdd ? 'Press “Add robot” above' : 'Ask an administrator of your organization to add one'}, or run this where the server runs:
      </Text>
      <Code block>mosaic server robot add my-robot</Code>
      <Text c="dimmed" size="sm">
        Either way you get a token for the robot’s <Code>mosaic_config.yaml</Code>; then <Code>mosaic run</Code> brings it online.
        {mayAdd && ' Without a robot at hand, “Use a phone” makes one of the phone in your pocket, or of this computer.'}
        To look around in a simulation: <Code>mosaic demo</Code>.
      </Text>
    </div>
  )
}

function LoadFailure({ failure, onRetry }: { failure: Failure; onRetry: () => void }) {
  return (
    <div className={classes.empty} role="alert">
      <Title order={2} size="h4">
        {failure.message}
      </Title>
      <Text c="dimmed" size="sm">
        {failure.cure}
      </Text>
      <Button variant="default" leftSection={<IconRefresh size={16} />} onClick={onRetry}>
        Try again
      </Button>
    </div>
  )
}

function Loading() {
  return (
    <div className={classes.list} aria-label="Loading" aria-busy>
      {[0, 1, 2].map((row) => (
        <Skeleton key={row} height={66} radius={0} />
      ))}
    </div>
  )
}

function summary(robots: readonly RobotSummary[]): string {
  const online = robots.filter((robot) => robot.isOnline).length
  return robots.length === 0 ? ' ' : `${online} of ${robots.length} online`
}

/** Fetches something beforehand. What fails here is fetched again, and told, when somebody needs it. */
function useSoon(fetch: () => Promise<unknown>, isWanted: boolean) {
  useEffect(() => {
    if (isWanted) fetch().catch(() => undefined)
  }, [fetch, isWanted])
}

function useRefresh() {
  const client = useMosaicClient()
  const [state, setState] = useState<{ isLoading: boolean; failure: Failure | null }>({ isLoading: true, failure: null })
  const refresh = useCallback(() => {
    client
      .refreshRobots()
      .then(() => setState({ isLoading: false, failure: null }))
      .catch((error: unknown) => setState({ isLoading: false, failure: failureOf(error) }))
  }, [client])
  useEffect(refresh, [refresh])
  return { ...state, refresh }
}
