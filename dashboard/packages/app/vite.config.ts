import react from '@vitejs/plugin-react'
import { defineConfig } from 'vite'
import { firstPage } from './firstPage'
import { mantineStyles } from './mantineStyles'
import { sharedModules } from './sharedModules'

/** The dashboard is served by mosaic-server, at its root, from its own package. */
const SERVED_FROM = '../../../plugins/mosaic-server/mosaic_server/dashboard'

/** `npm run dev` talks to a server on this machine; `MOSAIC_SERVER=http://host:port` names another. */
const server = process.env['MOSAIC_SERVER'] ?? 'http://127.0.0.1:9001'

export default defineConfig({
  plugins: [react(), mantineStyles(), sharedModules(), firstPage()],
  // The packages beside this one are their sources, as `paths` in tsconfig.json says.
  resolve: { tsconfigPaths: true },
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
