import { Button, PasswordInput, Stack, TextInput } from '@mantine/core'
import { useMosaicClient } from '@mosaic/react'
import { useState, type ReactNode, type SubmitEvent } from 'react'
import { signInFailureOf, type Failure } from './failure'
import { FailureAlert } from './FailureAlert'

/** What stands above the fields, and what is said before the first try. */
export interface SignInFormProps {
  /** Why the last session ended. */
  firstFailure?: Failure | null
  children?: ReactNode
}

/** Signs a person in by email and password; why that failed is said in the form, and what was typed stays. */
export function SignInForm({ firstFailure = null, children }: SignInFormProps) {
  const [failure, setFailure] = useState(firstFailure)
  const [isBusy, setIsBusy] = useState(false)
  const client = useMosaicClient()

  const submit = async (event: SubmitEvent<HTMLFormElement>) => {
    event.preventDefault()
    const form = new FormData(event.currentTarget)
    setIsBusy(true)
    setFailure(null)
    try {
      await client.login(fieldOf(form, 'email').trim(), fieldOf(form, 'password'))
    } catch (error) {
      setFailure(signInFailureOf(error))
      setIsBusy(false)
    }
  }

  return (
    <form onSubmit={(event) => void submit(event)} aria-label="Sign in">
      <Stack gap="md">
        {children}
        {failure !== null && <FailureAlert failure={failure} />}
        <TextInput name="email" label="Email" type="email" autoComplete="username" required autoFocus size="md" />
        <PasswordInput name="password" label="Password" autoComplete="current-password" required size="md" />
        <Button type="submit" size="md" loading={isBusy} fullWidth>
          Sign in
        </Button>
      </Stack>
    </form>
  )
}

function fieldOf(form: FormData, name: string): string {
  const value = form.get(name)
  return typeof value === 'string' ? value : ''
}
