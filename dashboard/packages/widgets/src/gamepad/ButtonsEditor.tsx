import { Button, Switch, Text } from '@mantine/core'
import classes from './GamepadEditor.module.css'
import { buttonName, isPressed, type GamepadMapping } from './gamepadMapping'
import type { LiveReading } from './useGamepadReading'

interface ButtonsEditorProps {
  mapping: GamepadMapping
  live: LiveReading | null
  isStandard: boolean
  /** The role whose button is the next one that is pressed. */
  learning: ButtonRole | null
  setLearning: (role: ButtonRole | null) => void
  onChange: (mapping: GamepadMapping) => void
}

export type ButtonRole = 'deadManButton' | 'stopButton'

/** Which button is held to drive, which one stops, and all of them as they are pressed now. */
export function ButtonsEditor({ mapping, live, isStandard, learning, setLearning, onChange }: ButtonsEditorProps) {
  const row = (role: ButtonRole, title: string) => (
    <div className={classes.role}>
      <Text size="sm">{title}</Text>
      <ButtonChip number={mapping[role]} live={live} isStandard={isStandard} />
      <Button
        size="compact-sm"
        variant="default"
        aria-label={`${title}: ${learning === role ? 'press the button now' : 'choose a button'}`}
        onClick={() => setLearning(learning === role ? null : role)}
      >
        {learning === role ? 'Press it now…' : 'Choose'}
      </Button>
      <Button
        size="compact-sm"
        variant="subtle"
        color="gray"
        aria-label={`${title}: no button`}
        onClick={() => onChange({ ...mapping, [role]: null })}
      >
        None
      </Button>
    </div>
  )
  return (
    <fieldset className={classes.buttons}>
      <legend>Buttons</legend>
      {row('deadManButton', 'Hold to drive')}
      {row('stopButton', 'Stop the robot')}
      <Switch
        label="The robot moves only while that button is held"
        description="Without it, a gamepad that lies on its stick drives the robot."
        checked={mapping.needsDeadMan}
        onChange={(event) => onChange({ ...mapping, needsDeadMan: event.currentTarget.checked })}
      />
      {mapping.needsDeadMan && mapping.deadManButton === null && (
        <Text size="sm" c="var(--m-warn)" role="status">
          No button is chosen: this gamepad will not drive.
        </Text>
      )}
      <div className={classes.live} aria-label="Buttons that are pressed now">
        {live?.buttons.map((_, number) => (
          <span key={number} data-pressed={isPressed(live, number)}>
            {number}
          </span>
        ))}
      </div>
    </fieldset>
  )
}

function ButtonChip({ number, live, isStandard }: { number: number | null; live: LiveReading | null; isStandard: boolean }) {
  const isDown = live !== null && isPressed(live, number)
  return (
    <span className={classes.chip} data-pressed={isDown}>
      {number === null ? 'none' : buttonName(number, isStandard)}
    </span>
  )
}
