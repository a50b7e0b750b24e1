/** All CSS of a package in one file; the names of CSS modules become those of that file. */
import { readFileSync } from 'node:fs'
import { createRequire } from 'node:module'
import { isAbsolute, join, relative } from 'node:path'
import { transform } from 'lightningcss'

export class Stylesheet {
  /** By path, in the order in which the files must stand: what is composed before what composes it. */
  #sheets = new Map()

  constructor(root) {
    this.root = root
  }

  get isEmpty() {
    return this.#sheets.size === 0
  }

  /** `path` is absolute, or of another package. */
  add(path) {
    if (this.#sheets.has(path)) return this.#sheets.get(path)
    const file = isAbsolute(path) ? path : createRequire(join(this.root, 'index.js')).resolve(path)
    const filename = relative(this.root, file)
    const cssModules = file.endsWith('.module.css') ? { pattern: 'mosaic-[hash]-[local]' } : false
    const { code, exports } = transform({ filename, code: readFileSync(file), cssModules, minify: true })
    const names = {}
    for (const [local, { name, composes }] of Object.entries(exports ?? {})) {
      names[local] = [...composes.map((part) => this.#composed(file, part, exports)), name].join(' ')
    }
    this.#sheets.set(path, { filename, names, code: code.toString() })
    return this.#sheets.get(path)
  }

  /** What the modules are to JavaScript: local name to class names. */
  modules() {
    const modules = [...this.#sheets.values()].filter(({ filename }) => filename.endsWith('.module.css'))
    return modules.map(({ filename, names }) => [`${filename}.js`, `export default ${JSON.stringify(names, null, 2)}\n`])
  }

  text() {
    return [...this.#sheets.values()].map(({ code }) => `${code}\n`).join('')
  }

  #composed(file, { type, name, specifier }, exports) {
    if (type === 'dependency') return this.add(join(file, '..', specifier)).names[name]
    return type === 'local' ? exports[name]?.name ?? name : name
  }
}
