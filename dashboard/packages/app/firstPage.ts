/** Writes every text of the built page compressed beside itself, and ends the build where the first page outgrew its budget. */
import { readdirSync, readFileSync, writeFileSync } from 'node:fs'
import { join } from 'node:path'
import { brotliCompressSync, constants, gzipSync } from 'node:zlib'
import type { Plugin } from 'vite'
import budgets from '../../../release/budgets.json'

/** What must arrive before somebody can sign in, compressed; with the other budgets of a release. */
export const FIRST_PAGE_BYTES = budgets.first_page
const TEXTS = /\.(html|js|css|svg|json)$/
/** Below this the headers of an answer weigh more than what is saved. */
const WORTH_IT_BYTES = 1000

/** The files that a browser fetches for `index.html`, which is one of them. */
export function firstPageFiles(html: string): string[] {
  const named = [...html.matchAll(/(?:src|href)="\/([^"]+)"/g)].flatMap(([, name]) => (name === undefined ? [] : [name]))
  return ['index.html', ...new Set(named)]
}

/** Puts `name.br` and `name.gz` beside each text; mosaic-server answers with what a browser takes. */
export function compressTexts(folder: string): void {
  for (const name of readdirSync(folder, { recursive: true, encoding: 'utf8' })) {
    if (!TEXTS.test(name)) continue
    const content = readFileSync(join(folder, name))
    if (content.length < WORTH_IT_BYTES) continue
    writeFileSync(join(folder, `${name}.br`), brotli(content))
    writeFileSync(join(folder, `${name}.gz`), gzipSync(content, { level: 9 }))
  }
}

/** How much comes over the line for the first page; fonts, which a page is shown without, are not counted. */
export function firstPageBytes(folder: string): number {
  const files = firstPageFiles(readFileSync(join(folder, 'index.html'), 'utf8'))
  return files.reduce((sum, name) => sum + brotli(readFileSync(join(folder, name))).length, 0)
}

export function checkBudget(bytes: number): void {
  if (bytes <= FIRST_PAGE_BYTES) return
  throw new Error(
    `The first page takes ${Math.ceil(bytes / 1000)} kB, compressed; ${FIRST_PAGE_BYTES / 1000} kB are its budget. ` +
      'Load what it does not show with `lazy(() => import(…))`.',
  )
}

/** After the build: compressed files, and the budget. */
export function firstPage(): Plugin {
  return {
    name: 'first-page',
    apply: 'build',
    writeBundle({ dir }) {
      if (dir === undefined) return
      compressTexts(dir)
      checkBudget(firstPageBytes(dir))
    },
  }
}

function brotli(content: Buffer): Buffer {
  return brotliCompressSync(content, { params: { [constants.BROTLI_PARAM_QUALITY]: constants.BROTLI_MAX_QUALITY } })
}
