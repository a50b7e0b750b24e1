import { defineConfig } from 'vitest/config'

export default defineConfig({
  test: {
    projects: [
      { test: { name: 'layers', include: ['test/**/*.test.ts'], environment: 'node' } },
      { test: { name: 'protocol', include: ['packages/protocol/**/*.test.ts'], environment: 'node' } },
      { test: { name: 'client', include: ['packages/client/**/*.test.ts'], environment: 'node' } },
      {
        test: {
          name: 'components',
          include: ['packages/{react,widgets,app}/**/*.test.{ts,tsx}'],
          environment: 'happy-dom',
        },
      },
    ],
  },
})
