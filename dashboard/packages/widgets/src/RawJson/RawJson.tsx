import { Notice } from '../frame/Notice'
import type { WidgetProps } from '../registry/WidgetDefinition'
import { useLatest } from '../stores/useReceived'
import { prettyJson } from './prettyJson'
import classes from './RawJson.module.css'

/** The last message as it came. */
export function RawJson({ store }: WidgetProps) {
  const latest = useLatest(store, 300)
  if (latest === null) return <Notice tone="wait" title="No value yet" />
  return <pre className={classes.root} tabIndex={0}>{prettyJson(latest.data)}</pre>
}
