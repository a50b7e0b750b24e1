import { defineConfig } from 'vitest/config'

// Packages are their sources here, as `paths` in tsconfig.json says; only a page of somebody else sees `dist`.
export default defineConfig({
  resolve: { tsconfigPaths: true },
  test: {
    projects: [
      { extends: true, test: { name: 'layers', include: ['test/**/*.test.ts'], environment: 'node' } },
      { extends: true, test: { name: 'protocol', include: ['packages/protocol/**/*.test.ts'], environment: 'node' } },
      { extends: true, test: { name: 'client', include: ['packages/client/**/*.test.ts'], environment: 'node' } },
      {
        extends: true,
        test: {
          name: 'components',
          include: ['packages/{react,widgets,app}/**/*.test.{ts,tsx}'],
          environment: 'happy-dom',
        },
      },
    ],
  },
})
