import { execFileSync } from 'node:child_process'
import { mkdtempSync, readFileSync, rmSync } from 'node:fs'
import { tmpdir } from 'node:os'
import { join } from 'node:path'
import ts from 'typescript'
import { expect, test } from 'vitest'

const EXAMPLE = new URL('../../examples/third-party-connector/', import.meta.url).pathname
const SOURCE = join(EXAMPLE, 'widget')
const DASHBOARD = new URL('..', import.meta.url).pathname

test('the widget of the example is the one that its sources build', () => {
  const folder = mkdtempSync(join(tmpdir(), 'example-widget-'))
  try {
    const words = [join(DASHBOARD, 'node_modules/vite/bin/vite.js'), 'build', '--outDir', folder, '--emptyOutDir', '--logLevel', 'error']
    const environment = { ...process.env, NODE_ENV: 'production' } // as a person builds it, not as a test
    execFileSync(process.execPath, words, { cwd: SOURCE, env: environment })
    const built = readFileSync(join(folder, 'acme-workbench.js'), 'utf8')
    expect(readFileSync(join(EXAMPLE, 'acme_workbench/widgets/acme-workbench.js'), 'utf8')).toBe(built)
  } finally {
    rmSync(folder, { recursive: true })
  }
})

test('its sources fit the library that they are written for', { timeout: 60_000 }, () => {
  const { config } = ts.readConfigFile(join(SOURCE, 'tsconfig.json'), (path) => ts.sys.readFile(path)) as { config: ts.ParsedCommandLine }
  const { options, fileNames } = ts.parseJsonConfigFileContent(config, ts.sys, SOURCE)
  // What `npm install` would put beside them is here.
  const paths = {
    '@mosaic/*': [join(DASHBOARD, 'packages/*/src/index.ts')],
    'react/jsx-runtime': [join(DASHBOARD, 'node_modules/@types/react/jsx-runtime.d.ts')],
    react: [join(DASHBOARD, 'node_modules/@types/react/index.d.ts')],
  }
  const types = [join(DASHBOARD, 'node_modules/vite/client.d.ts')]
  const program = ts.createProgram(fileNames, { ...options, paths, types })
  const own = fileNames.flatMap((name) => ts.getPreEmitDiagnostics(program, program.getSourceFile(name)))
  expect(fileNames).toHaveLength(1)
  expect(own.map(({ messageText }) => ts.flattenDiagnosticMessageText(messageText, '\n'))).toEqual([])
})
