import { Button, Stack, Switch, Text, TextInput } from '@mantine/core'
import type { CameraChoice } from '@mosaic/robot'
import { IconLockOpenOff, IconShare3 } from '@tabler/icons-react'
import { useState } from 'react'
import { deviceName } from '../session/deviceName'
import { FailureAlert } from '@mosaic/widgets'
import { CameraChooser } from './CameraChooser'
import { FIRST_CHOICES, sharable, SHARED, type Choices, type Shared } from './choices'
import classes from './share.module.css'
import type { Share } from './useShare'

/** What is shared, in words for whoever holds the phone. */
const WORDS: Record<Shared, { label: string; description: string }> = {
  camera: { label: 'Camera', description: 'On only while somebody watches.' },
  microphone: { label: 'Microphone', description: 'On only while somebody listens.' },
  loudspeaker: { label: 'Loudspeaker', description: 'Whoever watches may talk to this device.' },
  position: { label: 'Position', description: 'Where this device is.' },
  motion: { label: 'Motion', description: 'How it is turned and moved.' },
  battery: { label: 'Battery', description: 'How much charge is left.' },
}

/** Asks whoever holds the device what of it is shared; nothing is before the button is pressed. */
export function ShareForm({ share }: { share: Share }) {
  const { known, isBusy, failure } = share
  const [name, setName] = useState(() => deviceName(navigator.userAgent))
  const [choices, setChoices] = useState<Choices>(FIRST_CHOICES)
  const [has] = useState(sharable)
  const isShared = (one: Shared) => has.includes(one) && choices.shared[one]
  const wanted: Choices = { ...choices, shared: Object.fromEntries(SHARED.map((one) => [one, isShared(one)])) as Choices['shared'] }
  const choose = (one: Shared, on: boolean) => setChoices((now) => ({ ...now, shared: { ...now.shared, [one]: on } }))
  const film = (camera: CameraChoice) => setChoices((now) => ({ ...now, camera }))
  return (
    <Stack gap="md">
      <Text size="sm" c="dimmed">
        Everybody who may see the robots of your organization sees what you share here, until you press “Stop sharing” or close this page.
      </Text>
      {!window.isSecureContext && <NotSecure />}
      {failure !== null && <FailureAlert failure={failure} />}
      {known === null ? (
        <TextInput
          label="Name of the robot"
          value={name}
          onChange={(event) => setName(event.currentTarget.value)}
          maxLength={60}
          required
          size="md"
        />
      ) : (
        <div className={classes.known}>
          <span>
            This browser is the robot <strong>{known.name}</strong>.
          </span>
          <Button variant="subtle" color="gray" size="compact-sm" onClick={share.forget}>
            Be a new one
          </Button>
        </div>
      )}
      <ul className={classes.choices} aria-label="What is shared">
        {SHARED.map((one) => (
          <li key={one} className={classes.choice}>
            <Switch
              label={WORDS[one].label}
              description={has.includes(one) ? WORDS[one].description : 'This browser does not offer it here.'}
              disabled={!has.includes(one)}
              checked={isShared(one)}
              onChange={(event) => choose(one, event.currentTarget.checked)}
              labelPosition="left"
              size="md"
              classNames={{ body: classes.switchBody ?? '', labelWrapper: classes.switchLabel ?? '' }}
            />
            {one === 'camera' && isShared('camera') && <CameraChooser choice={choices.camera} onChoose={film} />}
          </li>
        ))}
      </ul>
      <Button
        size="lg"
        leftSection={<IconShare3 size={20} aria-hidden />}
        loading={isBusy}
        disabled={!Object.values(wanted.shared).includes(true) || (known === null && name.trim() === '')}
        onClick={() => void share.start(name.trim(), wanted)}
        fullWidth
      >
        Start sharing
      </Button>
    </Stack>
  )
}

/** Browsers give cameras and sensors to pages over https alone. */
function NotSecure() {
  return (
    <div className={classes.insecure} role="note">
      <IconLockOpenOff size={20} stroke={1.7} aria-hidden />
      <div>
        <strong>No camera and no sensors over http://</strong>
        <ul>
          <li>
            On the computer that the server runs on, open <code>http://localhost:{window.location.port || '80'}/share</code>.
          </li>
          <li>For a phone the server needs https: a certificate of its own, or a proxy in front of it.</li>
        </ul>
      </div>
    </div>
  )
}
