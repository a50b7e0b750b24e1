/**
 * Runs all checks of the dashboard side by side: types and lint, from one program of TypeScript; tests; the build of the
 * page; and the packages that are published. What fails is printed whole, and the others are still run to their end.
 */
import { spawn } from 'node:child_process'
import { availableParallelism } from 'node:os'
import { join, resolve } from 'node:path'
import process from 'node:process'

const ROOT = resolve(import.meta.dirname, '..')

/** The longest first, so that no core waits for it alone. */
const CHECKS = [
  ['types and lint', process.execPath, join(ROOT, 'scripts', 'lint.js')],
  ['packages', process.execPath, join(ROOT, 'scripts', 'packages.js'), '--check'],
  ['build', 'npm', 'run', '--silent', 'build'],
  ['tests', 'npm', 'run', '--silent', 'test'],
]

function run([name, command, ...words]) {
  const began = process.hrtime.bigint()
  const child = spawn(command, words, { cwd: ROOT })
  let said = ''
  for (const stream of [child.stdout, child.stderr]) stream.on('data', (text) => (said += text))
  return new Promise((done) => {
    child.on('error', (error) => done({ name, status: 1, said: String(error), seconds: 0 }))
    child.on('close', (status) => done({ name, status, said, seconds: Number(process.hrtime.bigint() - began) / 1e9 }))
  })
}

const waiting = [...CHECKS]

async function work() {
  for (let check = waiting.shift(); check !== undefined; check = waiting.shift()) {
    const { name, status, said, seconds } = await run(check)
    if (status !== 0) process.stderr.write(said)
    process.stdout.write(`${status === 0 ? 'ok    ' : 'FAILED'} ${name}, ${seconds.toFixed(0)} s\n`)
    if (status !== 0) process.exitCode = 1
  }
}

await Promise.all(Array.from({ length: Math.max(1, availableParallelism()) }, work))
