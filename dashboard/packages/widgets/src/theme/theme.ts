/** Mantine in the dashboard's tokens. Colours that change with the scheme live in `tokens.css`. */
import { createTheme, type CSSVariablesResolver, type MantineColorsTuple } from '@mantine/core'

const signal: MantineColorsTuple = [
  '#edf4ff',
  '#d8e7fd',
  '#aecdfb',
  '#82b2f9',
  '#5b9dff',
  '#3d87f2',
  '#2775e4',
  '#1a66d2',
  '#1256b5',
  '#0b4592',
]

const dark: MantineColorsTuple = [
  '#e7ecf2',
  '#b9c3ce',
  '#93a0af',
  '#657281',
  '#35404d',
  '#232c37',
  '#181f28',
  '#0b0e13',
  '#080b0f',
  '#05070a',
]

/** Mantine's own cross says nothing to a screen reader. */
const CLOSE = { 'aria-label': 'Close' }

/** For Mantine's `MantineProvider`, with `cssVariables` beside it. */
export const theme = createTheme({
  primaryColor: 'signal',
  primaryShade: { light: 7, dark: 7 },
  colors: { signal, dark },
  autoContrast: true,
  defaultRadius: 'md',
  cursorType: 'pointer',
  respectReducedMotion: true,
  fontFamily: "'Inter Variable', system-ui, -apple-system, 'Segoe UI', Roboto, sans-serif",
  fontFamilyMonospace: 'var(--m-mono)',
  fontSizes: { xs: '0.75rem', sm: '0.8125rem', md: '0.875rem', lg: '1rem', xl: '1.25rem' },
  headings: { fontWeight: '600' },
  components: {
    // Between the header of a page and the bar of a phone, where a robot's stop is.
    Modal: { defaultProps: { yOffset: 'calc(var(--m-bar) + 8px)', closeButtonProps: CLOSE } },
    // Its placeholder takes the focus inside of the menu, where only items may; without it the first item has it.
    Menu: { defaultProps: { withInitialFocusPlaceholder: false } },
    Drawer: { defaultProps: { closeButtonProps: CLOSE } },
  },
})

/** Mantine's own surfaces follow our tokens. */
export const cssVariables: CSSVariablesResolver = () => {
  const scheme = {
    '--mantine-color-body': 'var(--m-page)',
    '--mantine-color-text': 'var(--m-text)',
    '--mantine-color-dimmed': 'var(--m-muted)',
    '--mantine-color-default': 'var(--m-panel)',
    '--mantine-color-default-hover': 'var(--m-panel-raised)',
    '--mantine-color-default-border': 'var(--m-line-strong)',
    '--mantine-color-placeholder': 'var(--m-faint)',
    '--mantine-color-error': 'var(--m-bad)',
  }
  return { variables: {}, light: scheme, dark: scheme }
}
