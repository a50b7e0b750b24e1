import { defineConfig } from 'vitest/config'

// Packages are their sources here, as `paths` in tsconfig.json says; only a page of somebody else sees `dist`.
export default defineConfig({
  resolve: { tsconfigPaths: true },
  test: {
    // A thread per core loads the sources once and keeps them for all its files: no test may leave a global behind.
    pool: 'threads',
    isolate: false,
    // A machine with other work is no failure.
    testTimeout: 20_000,
    projects: [
      // One that wants a DOM all the same says so in its first line.
      {
        extends: true,
        test: { name: 'node', include: ['{test,packages}/**/*.test.ts'], exclude: ['**/node_modules/**'], environment: 'node' },
      },
      { extends: true, test: { name: 'page', include: ['packages/{react,widgets,app}/**/*.test.tsx'], environment: 'happy-dom' } },
    ],
  },
})
