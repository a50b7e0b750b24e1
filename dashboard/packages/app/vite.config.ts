import { readFileSync } from 'node:fs'
import { fileURLToPath } from 'node:url'
import react from '@vitejs/plugin-react'
import { defineConfig, type Alias } from 'vite'
import { firstPage } from './firstPage'
import { mantineStyles } from './mantineStyles'
import { sharedModules } from './sharedModules'

/** The dashboard is served by mosaic-server, at its root, from its own package. */
const SERVED_FROM = '../../../plugins/mosaic-server/mosaic_server/dashboard'

/** `npm run dev` talks to a server on this machine; `MOSAIC_SERVER=http://host:port` names another. */
const server = process.env['MOSAIC_SERVER'] ?? 'http://127.0.0.1:9001'

/** The packages beside this one are their sources, as `paths` in tsconfig.json says, whoever imports them: where they are
 * built, too, a page with both would have two contexts of React, and a widget of a plugin would find no provider. */
function sources(): Alias[] {
  const dashboard = new URL('../../', import.meta.url)
  const { compilerOptions } = JSON.parse(readFileSync(new URL('tsconfig.json', dashboard), 'utf8')) as {
    compilerOptions: { paths: Record<string, [string]> }
  }
  return Object.entries(compilerOptions.paths).map(([name, [file]]) => ({
    find: new RegExp(`^${name.replaceAll('.', String.raw`\.`)}$`),
    replacement: fileURLToPath(new URL(file, dashboard)),
  }))
}

export default defineConfig({
  plugins: [react(), mantineStyles(), sharedModules(), firstPage()],
  resolve: { alias: sources() },
  build: {
    outDir: SERVED_FROM,
    emptyOutDir: true,
    // Everything comes from files of our own origin, so that the server may forbid anything else.
    assetsInlineLimit: 0,
    chunkSizeWarningLimit: 900,
  },
  server: {
    proxy: {
      '/api': server,
      '/widgets': server,
      '/ws': { target: server, ws: true },
    },
  },
})
