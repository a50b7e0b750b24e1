import { CloseButton } from '@mantine/core'
import { nowMs, reasonOf, type StopReport, type StopView } from '@mosaic/client'
import { useControl, useControlEvents, useStop } from '@mosaic/react'
import { IconAlertOctagon, IconAlertTriangle } from '@tabler/icons-react'
import { useEffect, useState, type ReactNode } from 'react'
import classes from './control.module.css'
import { clearing, NOT_CERTIFIED, sinceText, stopReportText } from './controlText'
import { HoldButton } from './HoldButton'

const SINCE_PERIOD_MS = 1000

/** Says over the whole page that the robot is stopped: by whom, why, how quickly, and how it is cleared. */
export function StoppedBanner({ robotId }: { robotId: string }) {
  const view = useStop(robotId)
  const [dismissed, setDismissed] = useState<string | null>(null)
  const since = useSince(robotId, view)
  const { mine } = view
  // How quickly my stop went is no news of the next one, which somebody else may have said.
  useControlEvents(robotId, (event) => event.type === 'cleared' && setDismissed(mine?.id ?? null))
  if (view.isStopped || mine?.phase === 'sending') {
    const isMine = mine !== null && mine.id !== dismissed && isKnown(mine)
    return (
      <Banner tone="stopped" title={titleOf(view, isMine)} text={detailOf(view)} note={since}>
        {view.isStopped && <Clear robotId={robotId} />}
      </Banner>
    )
  }
  if (mine === null || mine.id === dismissed || (mine.phase !== 'unconfirmed' && mine.phase !== 'unavailable')) return null
  const isUnsent = mine.phase === 'unavailable' ? (mine.zeros?.sent.length ?? 0) === 0 : mine.copies === 0
  const isBad = mine.phase === 'unconfirmed' || isUnsent || (mine.zeros?.unsent.length ?? 0) > 0
  return (
    <Banner tone={isBad ? 'stopped' : 'zeros'} title={stopReportText(mine)} text={whatNow(mine.phase, isUnsent)} isOnTheWay={!isUnsent}>
      <CloseButton aria-label="Hide this" c="inherit" onClick={() => setDismissed(mine.id)} />
    </Banner>
  )
}

function whatNow(phase: StopReport['phase'], isUnsent: boolean): string {
  if (isUnsent) return 'Stop it at the robot.'
  if (phase === 'unconfirmed') return 'The connection ended before its answer. Stop it at the robot if you can’t see that it stands.'
  return 'Look at it: nothing here can confirm that it stands.'
}

interface BannerProps {
  tone: 'stopped' | 'zeros'
  title: string
  text: string
  /** What changes by the minute: shown, but not read out each time. */
  note?: string | undefined
  /** False: nothing was sent. */
  isOnTheWay?: boolean
  children: ReactNode
}

function Banner({ tone, title, text, note = '', isOnTheWay = true, children }: BannerProps) {
  const Icon = tone === 'stopped' ? IconAlertOctagon : IconAlertTriangle
  return (
    <section className={classes.banner} data-tone={tone} aria-label="Stop" data-testid="stopped-banner">
      <Icon size={30} stroke={1.8} aria-hidden />
      <div className={classes.bannerText}>
        <div role="alert">
          <strong>{title}</strong> <span>{text}</span>
        </div>
        <small>
          {note === '' ? '' : `${note}. `}
          {isOnTheWay ? NOT_CERTIFIED : ''}
        </small>
      </div>
      {children}
    </section>
  )
}

function isKnown({ phase }: StopReport): boolean {
  return phase === 'acknowledged' || phase === 'safe'
}

function titleOf({ isStopped, mine }: StopView, isMine: boolean): string {
  if (mine !== null && (isMine || !isStopped)) return stopReportText(mine)
  return 'Stopped'
}

function detailOf({ isStopped, by, reason, mine }: StopView): string {
  if (!isStopped && mine?.copies === 0) return 'It leaves as soon as the page is connected. Until then, stop it at the robot.'
  if (!isStopped) return 'Waiting for the robot’s answer; the stop is being repeated.'
  const who = by === '' ? 'Somebody stopped it' : `Stopped by ${by}`
  return `${who}${reason === '' ? '.' : `: “${reason}”.`} The robot takes no commands.`
}

/** Since when, as this page's clock says; the clocks may be compared only after the robot told of the stop. */
function useSince(robotId: string, { isStopped, sinceUs }: StopView): string {
  const { desk } = useControl(robotId)
  const [text, setText] = useState('')
  useEffect(() => {
    if (!isStopped || sinceUs === undefined) return undefined
    const show = () => setText(sinceText(desk.toPageMs(sinceUs), nowMs()))
    const timer = setInterval(show, SINCE_PERIOD_MS)
    return () => {
      clearInterval(timer)
      setText('')
    }
  }, [desk, isStopped, sinceUs])
  return text
}

/** Clearing is a deliberate act; who may not is told who may. */
function Clear({ robotId }: { robotId: string }) {
  const { me, leases } = useControl(robotId)
  const { clear } = useStop(robotId)
  const [isBusy, setIsBusy] = useState(false)
  const [refusal, setRefusal] = useState('')
  const { mayClear, text } = clearing(me, leases)
  if (!mayClear) return <span className={classes.bannerNote}>{text}</span>
  const clearNow = async () => {
    setIsBusy(true)
    const report = await clear()
    setIsBusy(false)
    setRefusal(report.isCleared ? '' : (report.message ?? reasonOf(report.code).sentence))
  }
  return (
    <span className={classes.bannerActions}>
      <HoldButton holding="Keep holding…" color="dark.8" size="md" loading={isBusy} onHeld={() => void clearNow()}>
        Hold to clear
      </HoldButton>
      {refusal !== '' && <span role="alert">{refusal}</span>}
    </span>
  )
}
