// @vitest-environment node
import { readFileSync } from 'node:fs'
import { expect, test } from 'vitest'
import { decodeScan, isCompactScan } from './compactScan'

interface Golden {
  scans: { name: string; hex: string; scan: { ranges: (number | null)[]; angle_min: number; angle_increment: number; range_max: number } }[]
  malformed_hex: string[]
}

const golden = JSON.parse(
  readFileSync(new URL('../../../../../tests/wire/payloads/laser_scans.json', import.meta.url), 'utf8'),
) as Golden

const bytesOf = (hex: string): ArrayBuffer => new Uint8Array(Buffer.from(hex, 'hex')).buffer

test.each(golden.scans)('the bytes that the robot writes are read: $name', async ({ hex, scan: wanted }) => {
  const data = bytesOf(hex)
  expect(isCompactScan(data)).toBe(true)
  const read = (await decodeScan(data)) as typeof wanted
  expect(read.ranges.map((one) => (one === null ? null : Math.round(one * 1000) / 1000))).toEqual(wanted.ranges)
  expect([read.angle_min, read.angle_increment, read.range_max]).toEqual([wanted.angle_min, wanted.angle_increment, wanted.range_max])
})

test.each(golden.malformed_hex.map((hex, index) => ({ hex, index })))('malformed bytes are refused: $index', async ({ hex }) => {
  await expect(decodeScan(bytesOf(hex))).rejects.toThrow()
})

test('JSON is no compact scan', () => {
  expect(isCompactScan(new TextEncoder().encode('{"ranges": []}').buffer)).toBe(false)
  expect(isCompactScan(new ArrayBuffer(0))).toBe(false)
})
