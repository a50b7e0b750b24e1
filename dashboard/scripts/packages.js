/**
 * Builds and packs the packages that are published, into `dist/*.tgz`: ESM and types by TypeScript, one file for one
 * file, and one `style.css` for all CSS of a package. With `--check` publint and arethetypeswrong judge each, and all are
 * installed into an empty folder and imported.
 */
import { spawn } from 'node:child_process'
import { copyFileSync, mkdirSync, mkdtempSync, readdirSync, readFileSync, rmSync, writeFileSync } from 'node:fs'
import { tmpdir } from 'node:os'
import { dirname, join, resolve, sep } from 'node:path'
import process from 'node:process'
import ts from 'typescript'
import { Stylesheet } from './Stylesheet.js'

const ROOT = resolve(import.meta.dirname, '..')
const TARBALLS = join(ROOT, 'dist')
/** Lowest first: each is built against what those before it became. */
const PUBLISHED = ['protocol', 'client', 'react', 'widgets']
/** Relative paths in imports, and in the addresses of workers, as TypeScript leaves them. */
const RELATIVE = /((?:from|import|URL\()\s*\(?)(['"])(\.\.?(?:\/[^'"]+)?)\2/g
/** CSS that is imported for its effect alone. */
const PLAIN_CSS = /^import ['"]([^'"]+\.css)['"];?\n/gm
/** What others publish is parsed once for all packages. */
const parsed = new Map()

function build(name) {
  const home = join(ROOT, 'packages', name)
  const source = join(home, 'src')
  const dist = join(home, 'dist')
  rmSync(dist, { recursive: true, force: true })
  const style = new Stylesheet(source)
  const options = optionsOf(source, dist)
  const program = ts.createProgram(entriesOf(source), options, hostOf(options))
  const emitted = program.emit(undefined, (path, text) => write(path, finished(text, dirname(path), dist, style)))
  stopOn([...ts.getPreEmitDiagnostics(program), ...emitted.diagnostics])
  for (const [path, text] of style.modules()) write(join(dist, path), text)
  if (!style.isEmpty) writeStyles(source, dist, style)
  copyFileSync(join(ROOT, '..', 'LICENSE'), join(home, 'LICENSE'))
}

/** The index reaches everything but workers, which are files of their own. */
function entriesOf(source) {
  const files = readdirSync(source, { recursive: true }).filter((file) => file.endsWith('.worker.ts'))
  return [join(source, 'index.ts'), ...files.map((file) => join(source, file))]
}

/** As in development, but packages are found as a user's page finds them: in `node_modules`, by their `exports`. */
function optionsOf(source, dist) {
  const { config } = ts.readConfigFile(join(ROOT, 'tsconfig.json'), (path) => readFileSync(path, 'utf8'))
  const { options } = ts.convertCompilerOptionsFromJson({ ...config.compilerOptions, paths: {} }, ROOT)
  return { ...options, noEmit: false, declaration: true, rootDir: source, outDir: dist, types: ['vite/client'] }
}

function hostOf(options) {
  const host = ts.createCompilerHost(options)
  const read = host.getSourceFile.bind(host)
  host.getSourceFile = (path, ...more) => {
    if (!path.includes(`${sep}node_modules${sep}`)) return read(path, ...more)
    if (!parsed.has(path)) parsed.set(path, read(path, ...more))
    return parsed.get(path)
  }
  return host
}

/** Browsers and Node want whole file names, and CSS travels in a file of its own. */
function finished(text, folder, dist, style) {
  const source = (path) => join(style.root, folder.slice(dist.length), path)
  const withoutCss = text.replace(PLAIN_CSS, (_line, path) => (style.add(path.startsWith('.') ? source(path) : path), ''))
  return withoutCss.replace(RELATIVE, (_all, before, quote, path) => {
    if (path.endsWith('.module.css')) style.add(source(path))
    return before + quote + wholeName(path) + quote
  })
}

function wholeName(path) {
  if (path.endsWith('.')) return `${path}/index.js`
  return path.endsWith('.worker.ts') ? `${path.slice(0, -3)}.js` : `${path}.js`
}

function writeStyles(source, dist, style) {
  const tokens = join(source, 'theme', 'tokens.css')
  copyFileSync(tokens, join(dist, 'tokens.css'))
  write(join(dist, 'style.css'), readFileSync(tokens, 'utf8') + style.text())
}

function write(path, text) {
  mkdirSync(dirname(path), { recursive: true })
  writeFileSync(path, text)
}

function stopOn(diagnostics) {
  if (diagnostics.length === 0) return
  const host = { getCanonicalFileName: (name) => name, getCurrentDirectory: () => ROOT, getNewLine: () => '\n' }
  process.stderr.write(ts.formatDiagnostics(diagnostics, host))
  process.exit(1)
}

const run = (command, ...words) => runIn(ROOT, command, ...words)

function runIn(folder, command, ...words) {
  const child = spawn(command, words, { cwd: folder })
  let said = `${command} ${words.join(' ')}\n`
  for (const stream of [child.stdout, child.stderr]) stream.on('data', (text) => (said += text))
  return new Promise((done) => {
    child.on('close', (status) => {
      if (status === 0) return done()
      process.stderr.write(said)
      process.exit(1)
    })
  })
}

async function pack() {
  rmSync(TARBALLS, { recursive: true, force: true })
  mkdirSync(TARBALLS)
  await run('npm', 'pack', '--silent', '--pack-destination', TARBALLS, ...PUBLISHED.flatMap((name) => ['--workspace', `@mosaic/${name}`]))
  return readdirSync(TARBALLS).map((file) => join(TARBALLS, file))
}

/** Installed into an empty folder, as on a user's machine, every package is found, and Node imports it. */
async function useAlone(tarballs) {
  const folder = mkdtempSync(join(tmpdir(), 'mosaic-packages-'))
  write(join(folder, 'package.json'), '{ "private": true, "type": "module" }')
  await runIn(folder, 'npm', 'install', '--silent', '--no-audit', '--no-fund', ...tarballs)
  for (const name of PUBLISHED) {
    const use = `const all = await import('@mosaic/${name}'); if (Object.keys(all).length === 0) throw new Error('empty')`
    await runIn(folder, process.execPath, '--input-type=module', '--eval', use)
  }
  rmSync(folder, { recursive: true })
}

const HELP = `Usage: node scripts/packages.js [--check]

Builds and packs @mosaic/${PUBLISHED.join(', @mosaic/')} into dashboard/dist/*.tgz.

  --check   let publint and arethetypeswrong judge each, and install and import all in an empty folder
  --help    show this and build nothing
`
const unknown = process.argv.slice(2).find((word) => !['--check', '--help', '-h'].includes(word))
if (unknown !== undefined) {
  process.stderr.write(`There is no option ${unknown}.\n\n${HELP}`)
  process.exit(2)
}
if (process.argv.includes('--help') || process.argv.includes('-h')) {
  process.stdout.write(HELP)
  process.exit(0)
}

for (const name of PUBLISHED) build(name)
const tarballs = await pack()
if (process.argv.includes('--check')) {
  const judged = tarballs.map(async (tarball) => {
    await run('publint', 'run', '--strict', tarball)
    await run('attw', tarball, '--profile', 'esm-only', '--exclude-entrypoints', 'style.css', 'tokens.css')
  })
  await Promise.all([...judged, useAlone(tarballs)])
}
