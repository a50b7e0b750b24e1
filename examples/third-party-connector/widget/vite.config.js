// `npm install && npm run build` writes ../acme_workbench/widgets/acme-workbench.js, which the wheel carries.
export default {
  build: {
    target: 'es2022',
    lib: { entry: 'acme-workbench.tsx', formats: ['es'], fileName: 'acme-workbench' },
    outDir: '../acme_workbench/widgets',
    emptyOutDir: true,
    // The dashboard gives these: its own React, its own connection to the robot.
    rolldownOptions: { external: [/^react/, /^@mosaic\//] },
  },
  oxc: { jsx: { runtime: 'automatic' } },
}
