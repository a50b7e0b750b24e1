import { ActionIcon, TextInput, Tooltip } from '@mantine/core'
import { IconEraser, IconPlayerPause, IconPlayerPlay } from '@tabler/icons-react'
import { useEffect, useRef, useState } from 'react'
import { Notice } from '../frame/Notice'
import type { WidgetProps } from '../registry/WidgetDefinition'
import { textOf } from '../stores/decode'
import { receives, type AnyStore } from '../stores/storeKinds'
import { throttled } from '../stores/useReceived'
import { LogLines, matching, type LogLine } from './LogLines'
import { logTextOf } from './logText'
import classes from './TextLog.module.css'

const PERIOD_MS = 150
/** So near to the end counts as being there: new lines then pull the view along. */
const AT_END_PX = 24

/** Text, or log messages, newest at the end. Whoever scrolls back is left in peace. */
export function TextLog({ entry, store }: WidgetProps) {
  const { lines, isPaused, setIsPaused, clear } = useLines(store, entry.dataType === 'string-r2u' ? textOf : logTextOf)
  const [search, setSearch] = useState('')
  const list = useRef<HTMLUListElement>(null)
  const isAtEnd = useRef(true)
  const shown = matching(lines, search)
  useEffect(() => {
    if (list.current !== null && isAtEnd.current) list.current.scrollTop = list.current.scrollHeight
  }, [shown])
  const hold = isPaused ? 'Go on' : 'Hold the log'
  return (
    <div className={classes.root}>
      <div className={classes.tools}>
        <TextInput
          size="xs"
          flex={1}
          placeholder="Filter"
          aria-label={`Filter ${entry.label}`}
          value={search}
          onChange={(event) => setSearch(event.currentTarget.value)}
        />
        <Tooltip label={hold}>
          <ActionIcon variant="default" size={30} aria-label={hold} aria-pressed={isPaused} onClick={() => setIsPaused(!isPaused)}>
            {isPaused ? <IconPlayerPlay size={15} /> : <IconPlayerPause size={15} />}
          </ActionIcon>
        </Tooltip>
        <Tooltip label="Forget these lines">
          <ActionIcon variant="default" size={30} aria-label="Forget these lines" onClick={clear}>
            <IconEraser size={15} />
          </ActionIcon>
        </Tooltip>
      </div>
      {lines.length === 0 ? (
        <Notice tone="wait" title="No message yet" />
      ) : (
        <ul
          ref={list}
          className={classes.lines}
          tabIndex={0}
          aria-label={`Messages of ${entry.label}`}
          onScroll={({ currentTarget: { scrollTop, clientHeight, scrollHeight } }) => {
            isAtEnd.current = scrollHeight - scrollTop - clientHeight < AT_END_PX
          }}
        >
          {shown.map((line) => (
            <li key={line.number}>{line.text}</li>
          ))}
        </ul>
      )}
    </div>
  )
}

function useLines(store: AnyStore, read: (data: ArrayBuffer) => string) {
  const [log] = useState(() => new LogLines())
  const [lines, setLines] = useState<readonly LogLine[]>([])
  const [isPaused, setIsPaused] = useState(false)
  useEffect(() => {
    if (!receives(store)) return undefined
    const show = throttled(() => setLines(log.get()), PERIOD_MS)
    const unsubscribe = store.subscribe((data) => {
      log.add(read(data))
      if (!isPaused) show.call()
    })
    return () => {
      unsubscribe()
      show.cancel()
    }
  }, [store, log, isPaused, read])
  const clear = () => {
    log.clear()
    setLines([])
  }
  return { lines, isPaused, setIsPaused, clear }
}
