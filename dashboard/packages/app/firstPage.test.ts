import { mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs'
import { tmpdir } from 'node:os'
import { join } from 'node:path'
import { brotliDecompressSync, gunzipSync } from 'node:zlib'
import { afterEach, beforeEach, expect, test } from 'vitest'
import { checkBudget, compressTexts, FIRST_PAGE_BYTES, firstPageBytes, firstPageFiles } from './firstPage'

const HTML = '<link rel="modulepreload" href="/assets/parts-1a.js"><script src="/main-2b.js"></script><link href="/main-2b.js">'
let folder: string

beforeEach(() => {
  folder = mkdtempSync(join(tmpdir(), 'first-page-'))
})
afterEach(() => rmSync(folder, { recursive: true }))

test('the first page is index.html and what it names, each once', () => {
  expect(firstPageFiles(HTML)).toEqual(['index.html', 'assets/parts-1a.js', 'main-2b.js'])
})

test('texts are compressed beside themselves, pictures and what is tiny are not', () => {
  const text = 'console.log("something that repeats")\n'.repeat(100)
  writeFileSync(join(folder, 'main.js'), text)
  writeFileSync(join(folder, 'tiny.js'), '1')
  writeFileSync(join(folder, 'picture.png'), text)
  compressTexts(folder)
  expect(brotliDecompressSync(readFileSync(join(folder, 'main.js.br'))).toString()).toBe(text)
  expect(gunzipSync(readFileSync(join(folder, 'main.js.gz'))).toString()).toBe(text)
  expect(() => readFileSync(join(folder, 'tiny.js.br'))).toThrow('ENOENT')
  expect(() => readFileSync(join(folder, 'picture.png.gz'))).toThrow('ENOENT')
})

test('the weight of the first page is counted as it is sent', () => {
  writeFileSync(join(folder, 'index.html'), '<script src="/main.js"></script>')
  writeFileSync(join(folder, 'main.js'), 'a'.repeat(100_000))
  writeFileSync(join(folder, 'later.js'), 'a'.repeat(100_000))
  expect(firstPageBytes(folder)).toBeLessThan(200)
})

test('a first page beyond its budget ends the build with what to do', () => {
  expect(() => checkBudget(FIRST_PAGE_BYTES)).not.toThrow()
  expect(() => checkBudget(FIRST_PAGE_BYTES + 1)).toThrow(/201 kB.*lazy/)
})
