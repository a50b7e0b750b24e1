import type { Finding } from '@mosaic/client'
import { useMosaicClient } from '@mosaic/react'
import { useCallback, useEffect, useState } from 'react'

export interface CheckState {
  findings: readonly Finding[]
  isRunning: boolean
  again: () => void
}

/** Runs the check when the page is opened, and again when asked to. */
export function useCheck(): CheckState {
  const client = useMosaicClient()
  const [run, setRun] = useState(0)
  const [findings, setFindings] = useState<readonly Finding[]>([])
  const [isRunning, setIsRunning] = useState(true)
  useEffect(() => {
    let isCurrent = true
    const found = (finding: Finding) => {
      if (isCurrent) setFindings((before) => [...before, finding])
    }
    const done = () => {
      if (isCurrent) setIsRunning(false)
    }
    client.checkConnection(found).then(done, done)
    return () => {
      isCurrent = false
    }
  }, [client, run])
  const again = useCallback(() => {
    setFindings([])
    setIsRunning(true)
    setRun((before) => before + 1)
  }, [])
  return { findings, isRunning, again }
}
