import { MantineProvider } from '@mantine/core'
import { cleanup, render, screen } from '@testing-library/react'
import userEvent from '@testing-library/user-event'
import { afterEach, expect, test, vi } from 'vitest'
import { CopyButton } from './CopyButton'

afterEach(() => {
  cleanup()
  vi.unstubAllGlobals()
})

/** A page on plain http, where `execCommand` gives this answer; returns what was selected when it was asked. */
async function copiedOnPlainHttp(answer: boolean): Promise<string[]> {
  const selected: string[] = []
  render(
    <MantineProvider env="test">
      <CopyButton text="token: abc" />
    </MantineProvider>,
  )
  const user = userEvent.setup()
  vi.stubGlobal('navigator', { userAgent: '' })
  const execCommand = () => {
    const field = document.activeElement
    if (field instanceof HTMLTextAreaElement) selected.push(field.value)
    return answer
  }
  Object.assign(document, { execCommand })
  await user.click(screen.getByRole('button', { name: 'Copy' }))
  return selected
}

test('the clipboard is used where there is one', async () => {
  render(
    <MantineProvider env="test">
      <CopyButton text="token: abc" />
    </MantineProvider>,
  )
  const user = userEvent.setup()
  await user.click(screen.getByRole('button', { name: 'Copy' }))
  await screen.findByRole('button', { name: 'Copied' })
  expect(await navigator.clipboard.readText()).toBe('token: abc')
})

test('on plain http the text is copied by way of a selection, which leaves nothing behind', async () => {
  expect(await copiedOnPlainHttp(true)).toEqual(['token: abc'])
  await screen.findByRole('button', { name: 'Copied' })
  expect(document.querySelector('textarea')).toBeNull()
})

test('a browser that refuses that, too, gets the text to copy by hand', async () => {
  await copiedOnPlainHttp(false)
  const field = await screen.findByLabelText<HTMLTextAreaElement>(/press Ctrl\+C/)
  expect(field.value).toBe('token: abc')
})
