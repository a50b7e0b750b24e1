// @vitest-environment node
import { readFileSync } from 'node:fs'
import { expect, test } from 'vitest'
import { decodeCloud } from './compactCloud'
import { CloudError } from './inflated'

interface Golden {
  clouds: {
    name: string
    hex: string
    resolution_m: number
    cloud: { xyz: number[][]; intensity: number[] | null; rgb: number[][] | null; frame_id: string; captured_at_s: number }
  }[]
  malformed_hex: string[]
}

const golden = JSON.parse(
  readFileSync(new URL('../../../../../tests/wire/payloads/point_clouds.json', import.meta.url), 'utf8'),
) as Golden

const bytesOf = (hex: string): ArrayBuffer => new Uint8Array(Buffer.from(hex, 'hex')).buffer

test.each(golden.clouds)('the bytes that the robot writes are read: $name', async ({ hex, cloud: wanted, resolution_m }) => {
  const cloud = await decodeCloud(bytesOf(hex))
  expect(cloud.count).toBe(wanted.xyz.length)
  wanted.xyz.forEach((point, index) =>
    point.forEach((value, axis) => {
      const place = (cloud.positions[3 * index + axis] ?? NaN) + (cloud.origin[axis] ?? NaN)
      expect(Math.abs(place - value)).toBeLessThanOrEqual(resolution_m / 2 + 1e-3)
    }),
  )
  expect(cloud.frameId).toBe(wanted.frame_id)
  expect(cloud.capturedUs).toBe(Math.round(wanted.captured_at_s * 1e6))
  expect(cloud.colours === null ? null : [...cloud.colours]).toEqual(wanted.rgb === null ? null : wanted.rgb.flat())
  const [low, high] = cloud.intensityRange
  wanted.intensity?.forEach((value, index) => {
    expect(Math.abs(low + ((cloud.intensities?.[index] ?? NaN) * (high - low)) / 255 - value)).toBeLessThan(0.5)
  })
  expect(cloud.intensities === null).toBe(wanted.intensity === null)
})

test.each(golden.malformed_hex.map((hex, index) => ({ hex, index })))('malformed bytes are refused: $index', async ({ hex }) => {
  await expect(decodeCloud(bytesOf(hex))).rejects.toBeInstanceOf(CloudError)
})

test('a body that inflates beyond its count is refused', async () => {
  const good = bytesOf(golden.clouds[0]?.hex ?? '')
  const bomb = new Blob([new Uint8Array(5_000_000)]).stream().pipeThrough(new CompressionStream('deflate'))
  const body = new Uint8Array(await new Response(bomb).arrayBuffer())
  const data = new Uint8Array(65 + body.length)
  data.set(new Uint8Array(good, 0, 65))
  data.set(body, 65)
  data[4] = (data[4] ?? 0) | 1
  await expect(decodeCloud(data.buffer)).rejects.toThrow('larger than its header says')
})
