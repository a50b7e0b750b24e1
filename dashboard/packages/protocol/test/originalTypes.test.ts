import { readFileSync } from 'node:fs'
import { expect, test } from 'vitest'
import { ORIGINAL_DRIVES, ORIGINAL_TYPES, type DriveCommand, type OriginalType } from '../src/index'

const golden = JSON.parse(
  readFileSync(new URL('../../../../tests/wire/original_types.json', import.meta.url), 'utf8'),
) as { types: OriginalType[]; drives: DriveCommand[] }

test('the connector types of the original MOSAIC are the golden ones, in their order', () => {
  expect(Object.values(ORIGINAL_TYPES)).toEqual(golden.types)
  expect(Object.keys(ORIGINAL_TYPES)).toEqual(golden.types.map(({ type }) => type))
})

test('so are the commands of its drives', () => {
  expect(Object.values(ORIGINAL_DRIVES)).toEqual(golden.drives)
})

test.each(Object.values(ORIGINAL_TYPES).filter(({ drive }) => drive !== undefined))(
  '$type takes a drive command that is there',
  ({ drive }) => expect(Object.keys(ORIGINAL_DRIVES)).toContain(drive),
)
