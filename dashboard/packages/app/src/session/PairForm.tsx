import { Button, Stack, Text, TextInput, Title } from '@mantine/core'
import { useMosaicClient } from '@mosaic/react'
import { useState, type SubmitEvent } from 'react'
import { Brand } from '../shell/Brand'
import { deviceName } from './deviceName'
import { type Failure, FailureAlert, failureOf } from '@mosaic/widgets'
import { isWholePin, shownPin } from './pin'
import classes from './SignInPage.module.css'

export interface PairFormProps {
  robot: string
  firstFailure: Failure | null
  onPassword: () => void
}

/** The PIN from the robot's screen lets this browser in, until somebody revokes it. */
export function PairForm({ robot, firstFailure, onPassword }: PairFormProps) {
  const [failure, setFailure] = useState(firstFailure)
  const [isBusy, setIsBusy] = useState(false)
  const [pin, setPin] = useState('')
  const [name, setName] = useState(() => deviceName(navigator.userAgent))
  const client = useMosaicClient()

  const submit = async (event: SubmitEvent<HTMLFormElement>) => {
    event.preventDefault()
    setIsBusy(true)
    setFailure(null)
    try {
      await client.pair({ pin }, name.trim())
    } catch (error) {
      setFailure(failureOf(error))
      setPin('')
      setIsBusy(false)
    }
  }

  return (
    <form onSubmit={(event) => void submit(event)} aria-label="Pair this device">
      <Stack gap="md">
        <Brand />
        <div>
          <Title order={1} size="h3">
            Pair with {robot}
          </Title>
          <Text c="dimmed" size="sm">
            Type the PIN that the robot’s terminal shows, or scan its QR code.
          </Text>
        </div>
        {failure !== null && <FailureAlert failure={failure} />}
        <TextInput
          classNames={{ input: classes.pin ?? '' }}
          label="PIN"
          value={pin}
          onChange={(event) => setPin(shownPin(event.currentTarget.value))}
          inputMode="numeric"
          autoComplete="one-time-code"
          placeholder="0000 0000"
          required
          autoFocus
          size="lg"
        />
        <TextInput
          label="Name of this device"
          description="Others see it when you drive."
          value={name}
          onChange={(event) => setName(event.currentTarget.value)}
          maxLength={60}
          required
          size="md"
        />
        <Button type="submit" size="md" loading={isBusy} disabled={!isWholePin(pin) || name.trim() === ''} fullWidth>
          Pair
        </Button>
        <Text c="dimmed" size="xs">
          No PIN there? On the robot, run <code>mosaic lan pair</code>. With an account of this robot’s server you can also{' '}
          <button type="button" className={classes.link} onClick={onPassword}>
            sign in with a password
          </button>
          .
        </Text>
      </Stack>
    </form>
  )
}
