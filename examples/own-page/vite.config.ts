import react from '@vitejs/plugin-react'
import { defineConfig, loadEnv } from 'vite'

export default defineConfig(({ mode }) => {
  const { MOSAIC_SERVER: target = 'http://127.0.0.1:9001' } = loadEnv(mode, '.', 'MOSAIC_')
  return { plugins: [react()], server: { proxy: { '/api': target, '/ws': { target, ws: true } } } }
})
