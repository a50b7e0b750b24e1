/** The listings in TypeScript on the pages fit the library; those with a title are one page, which the browser tests build. */
import { readdirSync, readFileSync } from 'node:fs'
import { join } from 'node:path'
import ts from 'typescript'
import { expect, test } from 'vitest'

const ROOT = join(new URL('..', import.meta.url).pathname, '..')
const LISTING = /^```tsx?(?: title="(?!src\/|vite)[^"]*")?\n(.*?)^```/gms
/** What a listing may take as given. */
const GIVEN = `
declare global {
  const robotId: string
  const video: HTMLVideoElement
  function show(value: unknown): void
}
export {}
`

function listings(): Map<string, string> {
  const pages = readdirSync(join(ROOT, 'docs'), { recursive: true, encoding: 'utf8' }).filter((page) => page.endsWith('.md'))
  const written = pages.filter((page) => !page.startsWith('reference/library'))
  return new Map(
    written.flatMap((page) => {
      const text = readFileSync(join(ROOT, 'docs', page), 'utf8')
      const found = [...text.matchAll(LISTING)].map(([, listing]) => listing ?? '')
      return found.map((listing, index) => [join(ROOT, 'dashboard', 'listings', `${page}-${index}.tsx`), listing] as const)
    }),
  )
}

function problemsOf(files: Map<string, string>): string[] {
  const read = (path: string) => readFileSync(path, 'utf8')
  const { config } = ts.readConfigFile(join(ROOT, 'dashboard', 'tsconfig.json'), read) as { config: { compilerOptions: object } }
  const { options } = ts.convertCompilerOptionsFromJson(config.compilerOptions, join(ROOT, 'dashboard'))
  const given = join(ROOT, 'dashboard', 'listings', 'given.ts')
  const all = new Map([...files, [given, GIVEN]])
  const host = ts.createCompilerHost(options)
  const parsed = host.getSourceFile.bind(host)
  host.fileExists = (path) => all.has(path) || ts.sys.fileExists(path)
  host.getSourceFile = (path, version) => {
    const text = all.get(path)
    return text === undefined ? parsed(path, version) : ts.createSourceFile(path, text, version)
  }
  const program = ts.createProgram([...all.keys()], options, host)
  return [...files.keys()].flatMap((path) => {
    const source = program.getSourceFile(path)
    return [...program.getSyntacticDiagnostics(source), ...program.getSemanticDiagnostics(source)].map(
      ({ messageText }) => `${path}: ${ts.flattenDiagnosticMessageText(messageText, ' ')}`,
    )
  })
}

test('every listing fits the library', { timeout: 60_000 }, () => {
  const found = listings()
  expect(found.size).toBeGreaterThan(3)
  expect(problemsOf(found)).toEqual([])
})

test('one that does not is told', { timeout: 60_000 }, () => {
  const path = join(ROOT, 'dashboard', 'listings', 'wrong.tsx')
  const [problem] = problemsOf(new Map([[path, "import { MosaicClient } from '@mosaic/client'\nnew MosaicClient().logon()\n"]]))
  expect(problem).toContain("'logon' does not exist")
})
