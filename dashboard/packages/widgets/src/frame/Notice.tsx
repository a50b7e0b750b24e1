import { IconAlertTriangle, IconCircleX, IconHourglassEmpty } from '@tabler/icons-react'
import type { ReactNode } from 'react'
import classes from './frame.module.css'

const ICONS = { wait: IconHourglassEmpty, warn: IconAlertTriangle, bad: IconCircleX }

/** How it is said, and what: `wait` is quiet, `warn` and `bad` are read out. */
export interface NoticeProps {
  tone: keyof typeof ICONS
  title: string
  children?: ReactNode
}

/** Said in place of a value: what is missing, and what to do about it. */
export function Notice({ tone, title, children }: NoticeProps) {
  const Icon = ICONS[tone]
  return (
    <div className={classes.notice} data-tone={tone} role={tone === 'wait' ? undefined : 'status'}>
      <Icon size={22} stroke={1.5} aria-hidden />
      <strong>{title}</strong>
      {children !== undefined && <span>{children}</span>}
    </div>
  )
}
