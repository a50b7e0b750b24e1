import { CloseButton } from '@mantine/core'
import { useControlEvents } from '@mosaic/react'
import { IconCircleCheck, IconInfoTriangle } from '@tabler/icons-react'
import { useEffect, useRef, useState } from 'react'
import classes from './control.module.css'
import { noticeOf, type ControlNotice } from './controlNews'

/** The newest thing that happened to this page's control: taken over, preempted, expired, handed over, denied. */
export function ControlNews({ robotId }: { robotId: string }) {
  const [notice, setNotice] = useState<ControlNotice | null>(null)
  const waiting = useRef(new Set<string>())
  useControlEvents(robotId, (event) => {
    const next = noticeOf(event, 'resource' in event && waiting.current.has(event.resource))
    if (event.type === 'queued') waiting.current.add(event.resource)
    else if ('resource' in event && event.type !== 'asked') waiting.current.delete(event.resource)
    // Having control again answers why it was lost.
    if (next !== null || event.type === 'granted') setNotice(next)
  })
  useEffect(() => {
    if (notice?.shownMs == null) return undefined
    const timer = setTimeout(() => setNotice(null), notice.shownMs)
    return () => clearTimeout(timer)
  }, [notice])
  return (
    <div aria-live="assertive" className={classes.news} data-testid="control-news">
      {notice !== null && (
        <section className={classes.newsCard} data-tone={notice.tone} aria-label="Control">
          {notice.tone === 'good' ? <IconCircleCheck size={20} aria-hidden /> : <IconInfoTriangle size={20} aria-hidden />}
          <span>
            <strong>{notice.title}</strong> {notice.text}
          </span>
          <CloseButton size="sm" aria-label="Hide this" onClick={() => setNotice(null)} />
        </section>
      )}
    </div>
  )
}
