import { spawnSync } from 'node:child_process'
import { readdirSync, readFileSync } from 'node:fs'
import { join } from 'node:path'
import { expect, test } from 'vitest'

const ROOT = new URL('..', import.meta.url).pathname
const PAGES = ['library.md', 'library-protocol.md'].map((page) => join(ROOT, '..', 'docs', 'reference', page))

test('the pages of the library name everything public, each with a sentence, as the code has it', { timeout: 60_000 }, () => {
  const { status, stderr } = spawnSync(process.execPath, [join(ROOT, 'scripts', 'libraryPage.js'), '--check'], { encoding: 'utf8' })
  expect({ status, stderr }).toEqual({ status: 0, stderr: '' })
})

test('every package that is published has a section on them', () => {
  const published = readdirSync(join(ROOT, 'packages'))
    .map((name) => JSON.parse(readFileSync(join(ROOT, 'packages', name, 'package.json'), 'utf8')) as { name: string; private?: boolean })
    .filter((about) => about.private !== true)
  const text = PAGES.map((page) => readFileSync(page, 'utf8')).join('\n')
  const sections = [...text.matchAll(/^## (@mosaic\/\w+):/gm)].map(([, name]) => name)
  expect(sections.sort()).toEqual(published.map(({ name }) => name).sort())
})
