import { readdirSync, readFileSync } from 'node:fs'
import { dirname, join, sep } from 'node:path'
import { describe, expect, test } from 'vitest'

/** Lowest first; a package may import those before it, and nothing else of ours. */
const LAYERS = ['protocol', 'client', 'robot', 'react', 'widgets', 'app']
const PACKAGES = new URL('../packages/', import.meta.url).pathname
const IMPORT = /(?:from|import)\s*\(?\s*['"]([^'"]+)['"]/g

function sources(name: string): string[] {
  const root = join(PACKAGES, name, 'src')
  const files = readdirSync(root, { recursive: true, encoding: 'utf8' })
  return files.filter((file) => /\.tsx?$/.test(file)).map((file) => join(root, file))
}

function importsOf(name: string): { file: string; target: string }[] {
  return sources(name).flatMap((file) =>
    [...readFileSync(file, 'utf8').matchAll(IMPORT)].map(([, target]) => ({ file, target: target ?? '' })),
  )
}

/** `@mosaic/widgets` of `@mosaic/widgets/tokens.css`. */
function packageOf(target: string): string {
  return target.split('/').slice(0, 2).join('/')
}

function dependenciesOf(name: string): string[] {
  const text = readFileSync(join(PACKAGES, name, 'package.json'), 'utf8')
  const { dependencies = {}, peerDependencies = {} } = JSON.parse(text) as Record<string, Record<string, string>>
  return Object.keys({ ...dependencies, ...peerDependencies })
}

describe.each(LAYERS)('%s', (name) => {
  const below = LAYERS.slice(0, LAYERS.indexOf(name)).map((layer) => `@mosaic/${layer}`)

  test('imports only the layers below it', () => {
    const ours = importsOf(name).filter(({ target }) => target.startsWith('@mosaic/'))
    expect(ours.filter(({ target }) => !below.includes(packageOf(target)))).toEqual([])
  })

  test('leaves no package by a relative path', () => {
    const home = join(PACKAGES, name) + sep
    const relative = importsOf(name).filter(({ target }) => target.startsWith('.'))
    expect(relative.filter(({ file, target }) => !join(dirname(file), target).startsWith(home))).toEqual([])
  })

  test('depends on nothing of ours but the layers below it', () => {
    const ours = dependenciesOf(name).filter((dependency) => dependency.startsWith('@mosaic/'))
    expect(ours.filter((dependency) => !below.includes(dependency))).toEqual([])
  })
})

test.each(['protocol', 'client', 'robot'])('%s knows no React, and no package from elsewhere', (name) => {
  expect(dependenciesOf(name).filter((dependency) => !dependency.startsWith('@mosaic/'))).toEqual([])
  const foreign = importsOf(name).filter(({ target }) => !/^(\.|@mosaic\/)/.test(target))
  expect(foreign).toEqual([])
})
