/** Code of the documentation, made to run: with what pages share in the place of its imports. */
import { readFileSync } from 'node:fs'
import { join } from 'node:path'
import * as client from '@mosaic/client'
import * as react from '@mosaic/react'
import * as widgets from '@mosaic/widgets'
import * as React from 'react'
import * as runtime from 'react/jsx-runtime'
import ts from 'typescript'

const PAGES = join(import.meta.dirname, '..', '..', 'docs', 'howto')
const SHARED = { react: React, 'react/jsx-runtime': runtime, '@mosaic/client': client, '@mosaic/react': react, '@mosaic/widgets': widgets }
const AS_A_SCRIPT = { compilerOptions: { module: ts.ModuleKind.CommonJS, target: ts.ScriptTarget.ES2022, jsx: ts.JsxEmit.ReactJSX } }

/** The listing of this file, which is its title or stands above it. */
export function listingOf(page: string, file: string): string {
  const listing = new RegExp(`^(?:\`${file}\`:\n\n\`\`\`\\w+|\`\`\`\\w+ title="${file}")\n(.*?)^\`\`\``, 'ms')
  const found = listing.exec(readFileSync(join(PAGES, page), 'utf8'))?.[1]
  if (found === undefined) throw new Error(`${page} has no ${file}`)
  return found
}

/** What the listing exports; `own`: modules of its page, by the path that it imports. */
export function exportsOf(listing: string, own: object = {}): Readonly<Record<string, unknown>> {
  const modules: Readonly<Record<string, unknown>> = { ...SHARED, ...own }
  const exported = {}
  // eslint-disable-next-line @typescript-eslint/no-implied-eval -- our own documentation
  const run = new Function('exports', 'require', ts.transpileModule(listing, AS_A_SCRIPT).outputText) as (exported: object, require: (name: string) => unknown) => void
  run(exported, (name) => modules[name])
  return exported
}
