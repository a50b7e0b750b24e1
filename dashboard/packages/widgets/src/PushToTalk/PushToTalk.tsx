import { useControl, useReadable } from '@mosaic/react'
import { IconMicrophone } from '@tabler/icons-react'
import { useEffect, useState, type KeyboardEvent, type PointerEvent } from 'react'
import { Notice } from '../frame/Notice'
import type { WidgetProps } from '../registry/WidgetDefinition'
import { talks, type AnyStore, type Talks } from '../stores/storeKinds'
import classes from './PushToTalk.module.css'
import { TalkSession, type TalkPhase } from './TalkSession'
import { talkText } from './talkText'

/** Talk through a loudspeaker of the robot while the button, or the space bar on it, is held. */
export function PushToTalk({ store, robotId, entry }: WidgetProps) {
  if (!talks(store)) return <Notice tone="bad" title="This connector takes no voice" />
  return <Talking store={store} robotId={robotId} label={entry.label} />
}

function Talking({ store, robotId, label }: { store: Talks & AnyStore; robotId: string; label: string }) {
  const session = useTalkSession(store)
  const phase = useReadable(session?.phase ?? SILENT)
  const problem = useReadable(session?.problem ?? NO_PROBLEM)
  const { me } = useControl(robotId)
  const talker = useReadable(store.talker)
  const refusal = useReadable(store.lastRefusal)
  const isOpen = useReadable(store.state).phase === 'open'
  const isObserver = me?.role === 'observer'
  const { tone, text } = talkText({ phase, problem, talker, refusal, ownPeerId: me?.peerId ?? null })
  useEffect(() => {
    if (!isOpen) session?.end()
  }, [session, isOpen])
  return (
    <div className={classes.root} data-testid="push-to-talk" data-phase={phase}>
      <button
        type="button"
        className={classes.button}
        aria-label={`Hold to talk to ${label}`}
        aria-pressed={phase === 'talking'}
        disabled={!isOpen || isObserver}
        {...holdHandlers(() => session?.begin(), () => session?.end())}
      >
        <IconMicrophone size={22} />
        {phase === 'silent' ? 'Hold to talk' : 'Release to end'}
      </button>
      <p className={classes.text} data-tone={isObserver ? 'warn' : tone} role="status">
        {isObserver ? 'Observers may listen, but not talk' : text}
      </p>
    </div>
  )
}

const SILENT = { get: (): TalkPhase => 'silent', subscribe: () => () => {} }
const NO_PROBLEM = { get: () => '', subscribe: () => () => {} }

function useTalkSession(store: Talks): TalkSession | null {
  const [session, setSession] = useState<TalkSession | null>(null)
  useEffect(() => {
    const devices = navigator.mediaDevices as MediaDevices | undefined
    const made = new TalkSession({
      getUserMedia: devices === undefined ? undefined : (constraints) => devices.getUserMedia(constraints),
      setTrack: (track) => store.setTrack(track),
      page: window,
      document,
    })
    // It listens to the page: it is made and disposed in pairs, not in render.
    // eslint-disable-next-line react-hooks/set-state-in-effect
    setSession(made)
    return () => {
      made.dispose()
      setSession(null)
    }
  }, [store])
  return session
}

/** The pointer is captured, so that a finger that slides off the button goes on talking, and a lost one ends it. */
function holdHandlers(begin: () => void, end: () => void) {
  const isHoldKey = ({ key }: KeyboardEvent) => key === ' ' || key === 'Enter'
  return {
    onPointerDown: (event: PointerEvent<HTMLButtonElement>) => {
      if (event.button !== 0) return
      event.currentTarget.setPointerCapture(event.pointerId)
      begin()
    },
    onPointerUp: end,
    onPointerCancel: end,
    onLostPointerCapture: end,
    onBlur: end,
    onContextMenu: (event: { preventDefault: () => void }) => event.preventDefault(),
    onKeyDown: (event: KeyboardEvent) => {
      if (!isHoldKey(event)) return
      event.preventDefault()
      if (!event.repeat) begin()
    },
    onKeyUp: (event: KeyboardEvent) => {
      if (!isHoldKey(event)) return
      event.preventDefault()
      end()
    },
  }
}
