/** Builds a module at a stable address for every library that widgets of plugins share with the page, so that there is one React. */
import { readFileSync } from 'node:fs'
import { createRequire } from 'node:module'
import { fileURLToPath } from 'node:url'
import type { Plugin } from 'vite'

/** What a widget of a plugin may import; `index.html` maps each to the address that this plugin gives it. */
export const SHARED = ['react', 'react/jsx-runtime', 'react-dom', '@mosaic/client', '@mosaic/react', '@mosaic/widgets'] as const
const FOLDER = 'shared'
const VIRTUAL = '\0shared:'
const IDENTIFIER = /^[A-Za-z_$][\w$]*$/
const MAP = /<script type="importmap">(.*?)<\/script>/s

/** The address of a shared library: the same in every build, since plugins are built elsewhere. */
export function sharedPath(name: string): string {
  return `${FOLDER}/${name.replace('@', '').replaceAll('/', '-')}.js`
}

/** What `index.html` must say to browsers. */
export function importMap(): { imports: Record<string, string> } {
  return { imports: Object.fromEntries(SHARED.map((name) => [name, `/${sharedPath(name)}`])) }
}

/** A module that exports what `name` does. React is CommonJS, of which nobody sees the names without running it. */
export function reexported(name: string, exportsOf: (name: string) => readonly string[]): string {
  const from = JSON.stringify(name)
  if (name.startsWith('@mosaic/')) return `export * from ${from}\n`
  const names = exportsOf(name).filter((one) => one !== 'default' && IDENTIFIER.test(one))
  return `export { ${names.join(', ')} } from ${from}\nimport whole from ${from}\nexport default whole\n`
}

/** The import map of a page; throws where it is not that of `SHARED`. */
export function checkImportMap(html: string): void {
  const text = MAP.exec(html)?.[1] ?? 'null'
  if (JSON.stringify(JSON.parse(text)) === JSON.stringify(importMap())) return
  throw new Error(`The import map in index.html must be ${JSON.stringify(importMap())}`)
}

/** The entries for the build, and the same addresses in development. */
export function sharedModules(): Plugin {
  const require = createRequire(import.meta.url)
  const exportsOf = (name: string): string[] => Object.keys(require(name) as object)
  return {
    name: 'shared-modules',
    config: () => ({
      build: {
        rolldownOptions: {
          input: { index: 'index.html', ...Object.fromEntries(SHARED.map((name) => [sharedPath(name), VIRTUAL + name])) },
          preserveEntrySignatures: 'exports-only',
          output: { entryFileNames: ({ name }) => (name.startsWith(`${FOLDER}/`) ? '[name]' : 'assets/[name]-[hash].js') },
        },
      },
    }),
    configureServer({ middlewares }) {
      middlewares.use((request, _, next) => {
        const name = SHARED.find((one) => request.url === `/${sharedPath(one)}`)
        if (name !== undefined) request.url = `/@id/${(VIRTUAL + name).replace('\0', '__x00__')}`
        next()
      })
    },
    buildStart() {
      checkImportMap(readFileSync(new URL('index.html', import.meta.url), 'utf8'))
    },
    resolveId(id, importer) {
      if (id.startsWith(VIRTUAL)) return id
      // Found from where the page finds it: `paths` of tsconfig.json count for real files alone.
      return importer?.startsWith(VIRTUAL) === true ? this.resolve(id, fileURLToPath(new URL('src/main.tsx', import.meta.url))) : null
    },
    load: (id) => (id.startsWith(VIRTUAL) ? reexported(id.slice(VIRTUAL.length), exportsOf) : null),
  }
}
