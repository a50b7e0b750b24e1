import js from '@eslint/js'
import reactHooks from 'eslint-plugin-react-hooks'
import tseslint from 'typescript-eslint'

export default tseslint.config(
  { ignores: ['**/dist/**', '**/node_modules/**', 'packages/protocol/src/generated.ts'] },
  js.configs.recommended,
  ...tseslint.configs.strictTypeChecked,
  {
    languageOptions: { parserOptions: { projectService: true, tsconfigRootDir: import.meta.dirname } },
    rules: {
      '@typescript-eslint/consistent-type-imports': 'error',
      '@typescript-eslint/switch-exhaustiveness-check': ['error', { considerDefaultExhaustiveForUnions: true }],
      // A number in a template is what people mean by it.
      '@typescript-eslint/restrict-template-expressions': ['error', { allowNumber: true }],
      // `() => set(x)` reads better than a block.
      '@typescript-eslint/no-confusing-void-expression': [
        'error',
        { ignoreArrowShorthand: true, ignoreVoidReturningFunctions: true },
      ],
      // A base class names what its subclasses are given.
      '@typescript-eslint/no-unused-vars': ['error', { argsIgnorePattern: '^_' }],
      // `getOrCreateStore(…) as ReceivableStore` is how MOSAIC documents it.
      '@typescript-eslint/no-unsafe-class-instance-assignment': 'off',
      // Hooks for subclasses start empty.
      '@typescript-eslint/no-empty-function': 'off',
      'no-restricted-syntax': [
        'error',
        { selector: 'TSEnumDeclaration', message: 'Use a union of literals.' },
        { selector: "NewExpression[callee.name='Date']", message: 'A wall clock lies: use the Clock of @mosaic/client.' },
        { selector: "MemberExpression[object.name='Date']", message: 'A wall clock lies: use the Clock of @mosaic/client.' },
      ],
      // Missing where the page is no secure context (http on a LAN).
      'no-restricted-properties': [
        'error',
        { object: 'crypto', property: 'randomUUID', message: 'Missing without https: use randomId of @mosaic/client.' },
        { object: 'crypto', property: 'subtle', message: 'Missing without https.' },
      ],
    },
  },
  { files: ['packages/{react,widgets,app}/**/*.{ts,tsx}'], ...reactHooks.configs.flat['recommended-latest'] },
  { files: ['**/*.js'], ...tseslint.configs.disableTypeChecked },
)
