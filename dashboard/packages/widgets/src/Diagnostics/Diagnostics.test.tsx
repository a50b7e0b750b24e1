import { messages, type CatalogueEntry } from '@mosaic/client'
import { MantineProvider } from '@mantine/core'
import { act, cleanup, render, screen } from '@testing-library/react'
import fc from 'fast-check'
import { afterEach, beforeEach, expect, test, vi } from 'vitest'
import { FakeStore } from '../../test/fakeStore'
import { levelNow, LEVELS, partReportOf, SILENT_AFTER_MS, summaryText, withReport, worstFirst, type PartReport } from './diagnostics'
import { Diagnostics } from './Diagnostics'

const ENTRY: CatalogueEntry = { label: 'health', type: 'x', kind: 'data', dataType: 'json-r2u', direction: 'to-operator', channels: [], delivery: 'reliable', schemaId: messages.SCHEMA_IDS.Diagnostic }

let store: FakeStore
beforeEach(() => {
  store = new FakeStore()
  vi.useFakeTimers()
})
afterEach(() => {
  cleanup()
  vi.useRealTimers()
})

function shown(): void {
  render(
    <MantineProvider env="test">
      <Diagnostics robotId="r" entry={ENTRY} store={store.asStore} />
    </MantineProvider>,
  )
}

const rows = () => screen.getAllByRole('listitem').map((row) => row.textContent)

test('the worst part comes first, and each has its newest word', () => {
  shown()
  expect(screen.getByText('No part has reported yet')).toBeTruthy()
  store.say({ level: 'ok', name: 'camera', message: 'fine' })
  store.say({ level: 'error', name: 'motor', hardware_id: 'left', message: 'too hot', values: { temperature: '91 °C' } })
  store.say({ level: 'warn', name: 'camera', message: 'slow' })
  expect(rows()).toEqual(['errormotorlefttoo hottemperature91 °C', 'warncameraslow'])
  expect(screen.getByRole('status').textContent).toBe('1 error, 1 warn')
})

test('a part that falls silent is marked', () => {
  shown()
  store.say({ level: 'ok', name: 'camera' })
  act(() => void vi.advanceTimersByTime(SILENT_AFTER_MS + 2000))
  expect(rows()[0]).toMatch(/^stalecameranot heard for 1[0-9] s$/)
  store.say({ level: 'ok', name: 'camera' })
  expect(rows()).toEqual(['okcamera'])
})

test.each([null, {}, { name: 'x', level: 'superb' }, { level: 'ok' }])('%j is no report', (message) => expect(partReportOf(message, 0)).toBeNull())

const reports = fc.array(
  fc.record({ name: fc.constantFrom('a', 'b', 'c'), level: fc.constantFrom(...LEVELS), heardAtMs: fc.integer({ min: 0, max: 30_000 }) }),
  { maxLength: 20 },
)

test('whatever is reported, each part is there once, in order, and the summary counts them all', () => {
  fc.assert(
    fc.property(reports, (given) => {
      const whole = given.map((one): PartReport => ({ ...one, hardwareId: '', message: '', values: [] }))
      const parts = whole.reduce<ReadonlyMap<string, PartReport>>(withReport, new Map())
      const sorted = worstFirst(parts.values(), 30_000)
      expect(new Set(sorted.map(({ name }) => name)).size).toBe(sorted.length)
      const ranks = sorted.map((report) => LEVELS.indexOf(levelNow(report, 30_000)))
      expect(ranks).toEqual([...ranks].sort((one, other) => one - other))
      const counted = summaryText(parts.values(), 30_000).match(/\d+/g)?.reduce((sum, count) => sum + Number(count), 0) ?? 0
      expect(counted).toBe(parts.size)
    }),
  )
})

test('a robot with very many parts is told in part', () => {
  let parts: ReadonlyMap<string, PartReport> = new Map()
  for (let number = 0; number < 300; number++) {
    const report = partReportOf({ level: 'ok', name: `part ${number}` }, number)
    if (report !== null) parts = withReport(parts, report)
  }
  expect(parts.size).toBe(200)
  expect([...parts.values()].at(-1)?.name).toBe('part 299')
})
