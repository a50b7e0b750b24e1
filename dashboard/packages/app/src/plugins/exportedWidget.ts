/** Takes a widget out of a loaded module, or says in plain words why that can't be. */
import { nearestName } from '@mosaic/client'
import type { WidgetProps } from '@mosaic/widgets'
import type { ComponentType } from 'react'

/** The contract between page and module: what is exported, which props are given, which libraries are shared. */
export const WIDGET_API_VERSION = 1

/** Throws an `Error` whose message people read. */
export function exportedWidget(module: Readonly<Record<string, unknown>>, name: string): ComponentType<WidgetProps> {
  const version = module['apiVersion']
  if (typeof version !== 'number') throw new Error(`It must say \`export const apiVersion = ${WIDGET_API_VERSION}\`.`)
  if (version !== WIDGET_API_VERSION) {
    const what = `It is written for version ${version} of the contract for widgets`
    throw new Error(`${what}, this dashboard knows ${WIDGET_API_VERSION}. Bring server and plugin to versions that fit.`)
  }
  const exported = module[name]
  if (isComponent(exported)) return exported
  if (exported !== undefined) throw new Error(`What it exports as ‘${name}’ is no component.`)
  const nearest = nearestName(name, Object.keys(module))
  throw new Error(`It exports no ‘${name}’${nearest === null ? '.' : `; did you mean ‘${nearest}’?`}`)
}

/** A function, a class, or what `memo`, `lazy` and `forwardRef` make. */
function isComponent(exported: unknown): exported is ComponentType<WidgetProps> {
  return typeof exported === 'function' || (typeof exported === 'object' && exported !== null && '$$typeof' in exported)
}
