/** Ends the build where a component of Mantine is shown whose styles `src/mantine.css` does not have. */
import { readdirSync, readFileSync } from 'node:fs'
import { createRequire } from 'node:module'
import { basename, dirname, join } from 'node:path'
import type { Plugin } from 'vite'

/** Mantine calls its classes by hashes, whole in styles and in scripts. */
const CLASS = /\bm_[0-9a-f]+\b/g

/** Those of `components`, by name, with a class that a script names and `css` does not have. */
export function missingStyles(scripts: string, css: string, components: ReadonlyMap<string, string>): string[] {
  const named = classesIn(scripts)
  const styled = classesIn(css)
  const isMissing = (own: string) => [...classesIn(own)].some((name) => named.has(name) && !styled.has(name))
  return [...components].flatMap(([name, own]) => (isMissing(own) ? [name] : []))
}

/** The styles of every component that Mantine has. */
export function componentStyles(): Map<string, string> {
  const folder = join(dirname(createRequire(import.meta.url).resolve('@mantine/core/styles.css')), 'styles')
  const names = readdirSync(folder).filter((name) => name.endsWith('.css') && !name.endsWith('.layer.css'))
  return new Map(names.map((name) => [basename(name, '.css'), readFileSync(join(folder, name), 'utf8')]))
}

export function mantineStyles(): Plugin {
  return {
    name: 'mantine-styles',
    apply: 'build',
    enforce: 'post',
    generateBundle(_options, bundle) {
      const files = Object.values(bundle)
      const scripts = files.map((file) => (file.type === 'chunk' ? file.code : ''))
      const css = files.map((file) => (file.type === 'asset' && file.fileName.endsWith('.css') ? String(file.source) : ''))
      const missing = missingStyles(scripts.join(), css.join(), componentStyles())
      if (missing.length > 0) this.error(`src/mantine.css has no styles for ${missing.join(', ')}: import them there, in the order of Mantine's styles.css.`)
    },
  }
}

function classesIn(text: string): Set<string> {
  return new Set(text.match(CLASS))
}
