import { readFileSync } from 'node:fs'
import { describe, expect, test } from 'vitest'
import { FrameReader, Partials, WireError } from '../src/index'

interface Step {
  at_s: number
  expire?: boolean
  reader?: string
  message_hex?: string
  completes_hex?: string
  refused?: string
  forgotten?: Record<string, number[]>
  kept_bytes: number
}

interface Scenario {
  name: string
  limit_bytes?: number
  readers: Record<string, { is_lossy: boolean }>
  steps: Step[]
}

const file = new URL('../../../../tests/wire/reassembly.json', import.meta.url)
const { scenarios } = JSON.parse(readFileSync(file, 'utf8')) as { scenarios: Scenario[] }

function outcome(reader: FrameReader, step: Step): Pick<Step, 'completes_hex' | 'refused'> {
  try {
    const frame = reader.read(Uint8Array.from(Buffer.from(step.message_hex ?? '', 'hex')), step.at_s * 1000)
    return frame === null ? {} : { completes_hex: Buffer.from(frame.payload).toString('hex') }
  } catch (error) {
    if (!(error instanceof WireError)) throw error
    return { refused: error.code }
  }
}

describe.each(scenarios)('$name', ({ limit_bytes: limitBytes, readers, steps }) => {
  test('is reassembled as written', () => {
    const partials = new Partials(limitBytes)
    const all = new Map(
      Object.entries(readers).map(([name, kind]) => [name, new FrameReader({ isLossy: kind.is_lossy, partials })]),
    )
    for (const step of steps) {
      const reader = all.get(step.reader ?? '')
      if (reader === undefined) partials.expire(step.at_s * 1000)
      else {
        const { completes_hex: completes, refused } = step
        const expected = { ...(completes !== undefined && { completes_hex: completes }), ...(refused !== undefined && { refused }) }
        expect(outcome(reader, step)).toEqual(expected)
      }
      const told = [...all].map(([name, one]) => [name, one.chunks.takeForgotten()] as const).filter(([, seqs]) => seqs.length > 0)
      expect(Object.fromEntries(told)).toEqual(step.forgotten ?? {})
      expect(partials.sizeBytes).toBe(step.kept_bytes)
    }
  })
})

test('a closed channel keeps nothing', () => {
  const partials = new Partials()
  const reader = new FrameReader({ partials })
  const [step] = scenarios[0]?.steps ?? []
  if (step === undefined) throw new Error('no scenario')
  outcome(reader, step)
  expect(partials.sizeBytes).toBeGreaterThan(0)
  reader.chunks.close()
  expect(partials.sizeBytes).toBe(0)
})
