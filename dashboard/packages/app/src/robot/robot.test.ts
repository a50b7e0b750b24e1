import type { CatalogueEntry } from '@mosaic/client'
import { widgets } from '@mosaic/widgets'
import { describe, expect, test } from 'vitest'
import { placesOf } from './layout'
import { readChoices, strayLabels, without, writeChoices } from './viewChoices'

const entry = (label: string, fields: Partial<CatalogueEntry> = {}): CatalogueEntry => ({
  label,
  type: 'x',
  kind: 'data',
  dataType: 'json-r2u',
  direction: 'to-operator',
  channels: [],
  delivery: 'reliable',
  ...fields,
})

const CAMERA = { dataType: 'media', kind: 'video' } as const

describe('the page', () => {
  test('leads with a picture, the drive pad beside it, then the rest in the order of the file', () => {
    const entries = [
      entry('host'),
      entry('cmd_vel', { widget: 'drive-pad', dataType: 'json-u2r' }),
      entry('front', CAMERA),
      entry('rear', CAMERA),
      entry('battery'),
    ]
    const places = placesOf(entries, widgets, {})
    expect(places.map((place) => place.entry.label)).toEqual(['front', 'cmd_vel', 'rear', 'host', 'battery'])
    expect(places.filter((place) => place.isLeading).map((place) => place.entry.label)).toEqual(['front', 'cmd_vel'])
    expect(places[2]?.columns).toBeLessThan(places[0]?.columns ?? 0)
  })

  test('keeps the leading control beside the leading picture, however many cameras there are', () => {
    const cameras = ['front', 'left', 'right', 'rear'].map((label) => entry(label, CAMERA))
    const places = placesOf([...cameras, entry('cmd_vel', { widget: 'drive-pad', dataType: 'json-u2r' })], widgets, {})
    expect(places.slice(0, 2).map((place) => place.entry.label)).toEqual(['front', 'cmd_vel'])
    expect((places[0]?.columns ?? 0) + (places[1]?.columns ?? 0)).toBe(12)
    expect(places[0]?.rows).toBe(places[1]?.rows)
  })

  test('shows a connector as a person chose', () => {
    expect(placesOf([entry('host')], widgets, { host: 'raw-json' })[0]?.widget?.id).toBe('raw-json')
  })

  test('keeps a place for what no widget shows', () => {
    expect(placesOf([entry('x', { dataType: 'byte-u2r' })], widgets, {})[0]?.widget).toBeNull()
  })
})

describe('choices', () => {
  const storage = (content: string | null) => {
    let kept = content
    return { getItem: () => kept, setItem: (_key: string, value: string) => void (kept = value) }
  }

  test('are remembered per robot', () => {
    const kept = storage(null)
    writeChoices(kept, 'r', { host: 'time-plot' })
    expect(readChoices(kept, 'r')).toEqual({ host: 'time-plot' })
  })

  test.each(['nonsense', '5', 'null', '{"host":5}'])('%s in the storage is no choice', (content) => {
    expect(readChoices(storage(content), 'r')).toEqual({})
  })

  test('a storage that is full or forbidden disturbs nothing', () => {
    const forbidden = {
      getItem: () => {
        throw new Error('no')
      },
      setItem: () => {
        throw new Error('no')
      },
    }
    expect(readChoices(forbidden, 'r')).toEqual({})
    expect(() => writeChoices(forbidden, 'r', {})).not.toThrow()
  })

  test('for labels that are gone are found and can be dropped', () => {
    expect(strayLabels({ host: 'a', camrea: 'b' }, ['host', 'camera'])).toEqual(['camrea'])
    expect(without({ a: 'x', b: 'y' }, 'a')).toEqual({ b: 'y' })
  })
})
