import { Button } from '@mantine/core'
import { useMosaicClient } from '@mosaic/react'
import { chooseWidget, widgets, type WidgetProps } from '@mosaic/widgets'
import { useEffect, useMemo, useState, type ComponentType } from 'react'
import { loadedWidget } from './loadedWidget'
import classes from './plugins.module.css'
import { sourceOf } from './servedModule'
import { wantedWidget, type WantedWidget } from './wantedWidget'

type Outcome = { Component: ComponentType<WidgetProps> } | { why: string } | null

/** The widget that the connector's plugin ships; where it can't be had, why not, and the stock widget in its place. */
export function PluginWidget(props: WidgetProps) {
  const [attempt, setAttempt] = useState(0)
  const wanted = useMemo(() => wantedWidget(props.entry), [props.entry])
  if (wanted === null) return null // the page chooses it for no such connector
  const key = `${wanted.module.sha256} ${wanted.exportName} ${attempt}`
  return <OneAttempt key={key} {...props} wanted={wanted} attempt={attempt} onAgain={() => setAttempt(attempt + 1)} />
}

interface OneAttemptProps extends WidgetProps {
  wanted: WantedWidget
  attempt: number
  onAgain: () => void
}

function OneAttempt({ wanted, attempt, onAgain, ...props }: OneAttemptProps) {
  const outcome = useOutcome(wanted, attempt)
  if (outcome === null) return <div aria-busy />
  if ('Component' in outcome) return <outcome.Component {...props} />
  const stock = chooseWidget(widgets, props.entry)
  return (
    <div className={classes.instead}>
      <p className={classes.why} role="status">
        {wanted.exportName} of {sourceOf(wanted.module)} can’t be shown. {outcome.why}{' '}
        <Button size="compact-xs" variant="default" onClick={onAgain}>
          Try again
        </Button>
      </p>
      {stock !== null && <stock.Component {...props} />}
    </div>
  )
}

function useOutcome(wanted: WantedWidget, attempt: number): Outcome {
  const { api } = useMosaicClient()
  const [outcome, setOutcome] = useState<Outcome>(null)
  useEffect(() => {
    let isCurrent = true
    const told = (next: Outcome) => {
      if (isCurrent) setOutcome(next)
    }
    loadedWidget(api, wanted, attempt).then(
      (Component) => told({ Component }),
      (error: unknown) => told({ why: error instanceof Error ? error.message : String(error) }),
    )
    return () => {
      isCurrent = false
    }
  }, [api, wanted, attempt])
  return outcome
}
