import { spawnSync } from 'node:child_process'
import { expect, test } from 'vitest'

test('the page of the library names everything public, each with a sentence, as the code has it', { timeout: 60_000 }, () => {
  const script = new URL('../scripts/libraryPage.js', import.meta.url).pathname
  const { status, stderr } = spawnSync(process.execPath, [script, '--check'], { encoding: 'utf8' })
  expect({ status, stderr }).toEqual({ status: 0, stderr: '' })
})
