import type { ControlDesk, JournalEntry } from '@mosaic/client'
import { useCallback, useEffect, useState } from 'react'
import { type Failure, failureOf } from '@mosaic/widgets'
import { joined } from './journalEntries'

const PAGE = 100
/** What happens meanwhile shows up by itself. */
const PERIOD_MS = 3000

export interface JournalView {
  entries: readonly JournalEntry[]
  failure: Failure | null
  isLoading: boolean
  /** False once the robot has no older ones. */
  hasOlder: boolean
  readOlder: () => Promise<void>
}

/** The robot's journal while it is looked at: the newest entries, refreshed, and older ones on demand. */
export function useJournal(desk: ControlDesk): JournalView {
  const [entries, setEntries] = useState<readonly JournalEntry[]>([])
  const [failure, setFailure] = useState<Failure | null>(null)
  const [isLoading, setIsLoading] = useState(true)
  const [hasOlder, setHasOlder] = useState(true)
  const took = useCallback((page: readonly JournalEntry[], isPage: boolean) => {
    setEntries((known) => joined(known, page))
    setFailure(null)
    setIsLoading(false)
    if (isPage && page.length < PAGE) setHasOlder(false)
  }, [])
  const failed = useCallback((error: unknown) => {
    setFailure(failureOf(error))
    setIsLoading(false)
  }, [])
  useEffect(() => {
    desk.readJournal(PAGE).then((page) => took(page, true), failed)
    const timer = setInterval(() => void desk.readJournal(PAGE).then((page) => took(page, false), failed), PERIOD_MS)
    return () => clearInterval(timer)
  }, [desk, took, failed])
  const readOlder = async () => {
    setIsLoading(true)
    await desk.readJournal(PAGE, entries.at(-1)?.number).then((page) => took(page, true), failed)
  }
  return { entries, failure, isLoading, hasOlder, readOlder }
}
