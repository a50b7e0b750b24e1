import { expect, test } from 'vitest'
import { componentStyles, missingStyles } from './mantineStyles'

const COMPONENTS = new Map([
  ['Button', '.m_77c9d27d{color:red}.m_80f1301b{color:red}'],
  ['Text', '.m_b6d8b162{color:red}'],
])

test.each([
  ['nothing is missing where the styles are', '"m_77c9d27d"', '.m_77c9d27d{color:red}', []],
  ['nor what no script names', '"m_77c9d27d"', '.m_77c9d27d{color:blue}', []],
  ['what a script names and the styles lack is', '"m_77c9d27d","m_b6d8b162"', '.m_77c9d27d{color:red}', ['Text']],
  ['a class that Mantine styles nowhere is not', '"m_deadbeef"', '', []],
])('%s', (_name, scripts, css, missing) => {
  expect(missingStyles(scripts, css, COMPONENTS)).toEqual(missing)
})

test('the styles are found by component', () => {
  expect(componentStyles().get('Button')).toMatch(/\.m_[0-9a-f]+/)
})
