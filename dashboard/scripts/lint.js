/** Says what TypeScript and ESLint find wrong, both from one program: most of the time of either goes into its types. */
import { readFileSync } from 'node:fs'
import { join, resolve } from 'node:path'
import process from 'node:process'
import { ESLint } from 'eslint'
import ts from 'typescript'

const ROOT = resolve(import.meta.dirname, '..')

function wholeProgram() {
  const { config } = ts.readConfigFile(join(ROOT, 'tsconfig.json'), (path) => readFileSync(path, 'utf8'))
  const { options, fileNames } = ts.parseJsonConfigFileContent(config, ts.sys, ROOT)
  return ts.createProgram(fileNames, options, ts.createCompilerHost(options, true))
}

const host = { getCanonicalFileName: (name) => name, getCurrentDirectory: () => ROOT, getNewLine: () => '\n' }
const program = wholeProgram()
const diagnostics = ts.getPreEmitDiagnostics(program)
process.stderr.write(ts.formatDiagnostics(diagnostics, host))

const parserOptions = { programs: [program], projectService: false }
const eslint = new ESLint({ cwd: ROOT, overrideConfig: { files: ['**/*.{ts,tsx}'], languageOptions: { parserOptions } } })
const results = await eslint.lintFiles(['.'])
const formatter = await eslint.loadFormatter('stylish')
process.stderr.write(await formatter.format(results))

const isClean = results.every(({ errorCount, warningCount }) => errorCount + warningCount === 0)
process.exitCode = diagnostics.length === 0 && isClean ? 0 : 1
