import { Notice } from '../frame/Notice'
import raw from '../RawJson/RawJson.module.css'
import type { WidgetProps } from '../registry/WidgetDefinition'
import { useLatest } from '../stores/useReceived'
import { hexDump } from './hexDump'

/** The last binary message, byte by byte. */
export function ByteView({ store }: WidgetProps) {
  const latest = useLatest(store, 300)
  if (latest === null) return <Notice tone="wait" title="No value yet" />
  return (
    <pre className={raw.root} tabIndex={0}>
      {`${latest.data.byteLength} bytes\n\n${hexDump(latest.data)}`}
    </pre>
  )
}
