import { Stack, Text, Title } from '@mantine/core'
import { SignInForm, type Failure } from '@mosaic/widgets'
import { Brand } from '../shell/Brand'

export function PasswordForm({ firstFailure }: { firstFailure: Failure | null }) {
  return (
    <Stack gap="md">
      <SignInForm firstFailure={firstFailure}>
        <Brand />
        <div>
          <Title order={1} size="h3">
            Sign in
          </Title>
          <Text c="dimmed" size="sm">
            to see and drive your robots
          </Text>
        </div>
      </SignInForm>
      <Text c="dimmed" size="xs">
        No account yet? On the server’s machine, run <code>mosaic server user add EMAIL</code>.
      </Text>
    </Stack>
  )
}
