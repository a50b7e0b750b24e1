/** Fetches a widget of a plugin: asks the server what it serves, imports that module in time, and takes the component out. */
import type { RestApi, WidgetOffer } from '@mosaic/client'
import type { WidgetProps } from '@mosaic/widgets'
import { createElement, type ComponentType } from 'react'
import { exportedWidget } from './exportedWidget'
import { servedModule } from './servedModule'
import type { WantedWidget } from './wantedWidget'

/** Long enough for the largest module (2 MiB) on a poor link of 1 Mbit/s. */
export const LOAD_TIMEOUT_MS = 20_000

export type ImportModule = (url: string) => Promise<Readonly<Record<string, unknown>>>

const importModule: ImportModule = (url) => import(/* @vite-ignore */ url) as ReturnType<ImportModule>

/** What the server serves is asked once per page, for all cards. */
const offers = new WeakMap<object, Promise<WidgetOffer>>()

/**
 * Rejects with an `Error` whose message people read. `attempt`: 0 at first; a browser remembers what it failed to load or
 * to run under an address, so that each further attempt has another.
 */
export async function loadedWidget(
  api: Pick<RestApi, 'widgets'>,
  { module, exportName }: WantedWidget,
  attempt: number,
  load: ImportModule = importModule,
): Promise<ComponentType<WidgetProps>> {
  const served = servedModule(module, await offerOf(api, attempt > 0))
  if ('why' in served) throw new Error(served.why)
  const url = attempt === 0 ? served.url : `${served.url}?attempt=${attempt}`
  return exportedWidget(await inTime(checkedReact(load).then(() => load(url)), `${module.name}.js`), exportName)
}

/** A page that was opened before the server got a newer one would get that one's React beside its own. */
async function checkedReact(load: ImportModule): Promise<void> {
  const { createElement: shared } = await load('react') // by the import map, as widgets do
  if (shared !== createElement) throw new Error('The server has a newer page than this one: reload it.')
}

function offerOf(api: Pick<RestApi, 'widgets'>, isAnew: boolean): Promise<WidgetOffer> {
  const known = isAnew ? undefined : offers.get(api)
  if (known !== undefined) return known
  const asked = api.widgets().catch((error: unknown) => {
    offers.delete(api)
    throw new Error(`The server does not say which widgets it has; it may be away, or too old for them. ${wordsOf(error)}`)
  })
  offers.set(api, asked)
  return asked
}

async function inTime<T>(loading: Promise<T>, file: string): Promise<T> {
  let timer: ReturnType<typeof setTimeout> | undefined
  const late = new Promise<never>((_, reject) => {
    timer = setTimeout(() => reject(new Error(`Its code did not arrive within ${LOAD_TIMEOUT_MS / 1000} s.`)), LOAD_TIMEOUT_MS)
  })
  try {
    return await Promise.race([loading.catch((error: unknown) => cannotLoad(error, file)), late])
  } finally {
    clearTimeout(timer)
  }
}

function cannotLoad(error: unknown, file: string): never {
  if (isUnreadable(error)) {
    // Firefox alone tells where.
    const place = 'lineNumber' in error ? `${file}:${String(error.lineNumber)}` : file
    throw new Error(`${place} is no JavaScript: ${error.message}. \`node --check ${file}\` shows the line.`)
  }
  throw new Error(`Its code could not be loaded. ${wordsOf(error)}`)
}

/** A name that another module does not export is a SyntaxError as well, and says which. */
function isUnreadable(error: unknown): error is SyntaxError {
  return error instanceof SyntaxError && !/export|import/i.test(error.message)
}

function wordsOf(error: unknown): string {
  return error instanceof Error ? error.message : String(error)
}
