import { useLatestJson, type WidgetProps } from '@mosaic/widgets'
import { useState } from 'react'

export const apiVersion = 1

const COLDEST_C = 20
const HOTTEST_C = 100

interface Temperature {
  temperature_c: number
}

/** A column that rises to the temperature, and the temperature in the unit that one likes. */
export function ThermometerPanel({ entry, store }: WidgetProps) {
  const [isFahrenheit, setIsFahrenheit] = useState(false)
  const latest = useLatestJson(store) as Temperature | null
  if (latest === null) return <p style={{ margin: 'auto', color: 'var(--m-faint)' }}>No reading yet</p>
  const { temperature_c } = latest
  const shown = isFahrenheit ? `${((temperature_c * 9) / 5 + 32).toFixed(1)} °F` : `${temperature_c.toFixed(1)} °C`
  return (
    <div style={{ margin: 'auto', display: 'flex', flexDirection: 'column', gap: 12, alignItems: 'center' }}>
      <strong style={{ fontSize: '2rem' }}>{shown}</strong>
      <meter aria-label={`Temperature of ${entry.label}`} min={COLDEST_C} high={80} max={HOTTEST_C} value={temperature_c} />
      <button onClick={() => setIsFahrenheit(!isFahrenheit)}>in {isFahrenheit ? '°C' : '°F'}</button>
    </div>
  )
}
