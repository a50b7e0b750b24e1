import { Alert, Button, Group, Modal, NativeSelect, Slider, Stack, Switch, Text } from '@mantine/core'
import { useReadable } from '@mosaic/react'
import { IconAlertTriangle, IconDeviceGamepad2 } from '@tabler/icons-react'
import { useEffect, useState } from 'react'
import {
  AXIS_LIMITS,
  axisName,
  DRIVE_AXES,
  isPressed,
  shaped,
  type AxisMapping,
  type DriveAxis,
} from './gamepadMapping'
import { ButtonsEditor, type ButtonRole } from './ButtonsEditor'
import classes from './GamepadEditor.module.css'
import type { ActiveGamepad, GamepadSource } from './GamepadSource'
import { defaultMapping } from './gamepadStorage'
import { useGamepadReading, type LiveReading } from './useGamepadReading'

const WAYS: Record<DriveAxis, { title: string; plus: string; minus: string }> = {
  forward: { title: 'Drive', plus: 'ahead', minus: 'back' },
  left: { title: 'Turn', plus: 'left', minus: 'right' },
  sideways: { title: 'Sideways', plus: 'left', minus: 'right' },
}
const NONE = ''

export interface GamepadEditorProps {
  source: GamepadSource
  onClose: () => void
}

/** What each axis and button of the gamepad does, with everything it reports shown live. While it is open nothing drives. */
export default function GamepadEditor({ source, onClose }: GamepadEditorProps) {
  const gamepad = useReadable(source.active)
  useEffect(() => source.beginEditing(), [source])
  return (
    <Modal opened onClose={onClose} size="lg" title={gamepad === null ? 'Gamepad' : gamepad.name}>
      {gamepad === null ? <Wake /> : <Editor key={gamepad.kind.id} source={source} gamepad={gamepad} onClose={onClose} />}
    </Modal>
  )
}

function Wake() {
  return (
    <div className={classes.wake} role="status">
      <IconDeviceGamepad2 size={40} stroke={1.3} aria-hidden />
      <strong>Press any button on the gamepad</strong>
      <span>Browsers show a gamepad only after its first button. Plug it in or pair it, then press one.</span>
    </div>
  )
}

interface EditorProps {
  source: GamepadSource
  gamepad: ActiveGamepad
  onClose: () => void
}

function Editor({ source, gamepad, onClose }: EditorProps) {
  const [mapping, setMapping] = useState(gamepad.mapping)
  const [isForgetful, setIsForgetful] = useState(false)
  const [learning, setLearning] = useState<ButtonRole | null>(null)
  const live = useGamepadReading(source, (reading) => {
    const pressed = reading.buttons.findIndex((_, number) => isPressed(reading, number))
    if (learning === null || pressed < 0) return
    setMapping({ ...mapping, [learning]: pressed })
    setLearning(null)
  })
  const isStandard = gamepad.kind.mapping === 'standard'
  const save = () => {
    if (source.keepMapping(mapping)) onClose()
    else setIsForgetful(true)
  }
  return (
    <Stack gap="lg">
      {!gamepad.isTrusted && (
        <Alert color="orange" icon={<IconAlertTriangle size={18} />} title="The browser does not know this gamepad">
          Move the sticks and compare before you save: until then it does not drive.
        </Alert>
      )}
      {isForgetful && <Alert color="orange">This browser can’t remember the mapping; it lasts until the page is closed.</Alert>}
      <div className={classes.axes}>
        {DRIVE_AXES.map((way) => (
          <AxisEditor
            key={way}
            way={way}
            axis={mapping.axes[way]}
            live={live}
            isStandard={isStandard}
            onChange={(axis) => setMapping({ ...mapping, axes: { ...mapping.axes, [way]: axis } })}
          />
        ))}
      </div>
      <ButtonsEditor {...{ mapping, live, isStandard, learning, setLearning }} onChange={setMapping} />
      <Group justify="space-between">
        <Button variant="subtle" color="gray" onClick={() => setMapping(defaultMapping(gamepad.kind))}>
          Use the defaults
        </Button>
        <Group gap="sm">
          <Button variant="default" onClick={onClose}>
            {isForgetful ? 'Close' : 'Cancel'}
          </Button>
          <Button onClick={save}>Save</Button>
        </Group>
      </Group>
    </Stack>
  )
}

interface AxisEditorProps {
  way: DriveAxis
  axis: AxisMapping
  live: LiveReading | null
  isStandard: boolean
  onChange: (axis: AxisMapping) => void
}

function AxisEditor({ way, axis, live, isStandard, onChange }: AxisEditorProps) {
  const { title, plus, minus } = WAYS[way]
  const raw = axis.axis === null ? 0 : (live?.axes[axis.axis] ?? 0)
  const choices = (live?.axes ?? []).map((_, number) => ({ value: String(number), label: axisName(number, isStandard) }))
  const set = (change: Partial<AxisMapping>) => onChange({ ...axis, ...change })
  return (
    <fieldset className={classes.axis}>
      <legend>{title}</legend>
      <NativeSelect
        aria-label={`${title}: axis`}
        data={[{ value: NONE, label: 'not used' }, ...choices]}
        value={axis.axis === null ? NONE : String(axis.axis)}
        onChange={(event) => set({ axis: event.currentTarget.value === NONE ? null : Number(event.currentTarget.value) })}
      />
      <Meter raw={raw} shaped={shaped(raw, axis)} deadZone={axis.deadZone} plus={plus} minus={minus} />
      {axis.axis !== null && (
        <>
          <Fine name={`${title}: dead zone`} label="Dead zone" of="deadZone" axis={axis} set={set} step={0.01} />
          <Fine name={`${title}: fineness`} label="Fineness" of="exponent" axis={axis} set={set} step={0.1} />
          <Fine name={`${title}: share of the limit`} label="Full deflection" of="scale" axis={axis} set={set} step={0.05} />
          <Switch
            label={`Swap ${plus} and ${minus}`}
            checked={axis.isInverted}
            onChange={(event) => set({ isInverted: event.currentTarget.checked })}
          />
        </>
      )}
    </fieldset>
  )
}

/** What the axis reports (thin) and what becomes of it (thick), from one way to the other. */
function Meter({ raw, shaped: result, deadZone, plus, minus }: { raw: number; shaped: number; deadZone: number; plus: string; minus: string }) {
  const place = (value: number) => `${50 - Math.max(-1, Math.min(1, value)) * 50}%`
  return (
    <div className={classes.meter} role="img" aria-label={`${Math.round(result * 100)} % ${result < 0 ? minus : plus}`}>
      <span className={classes.meterEnds}>
        <span>{plus}</span>
        <span>{minus}</span>
      </span>
      <span className={classes.track}>
        <span className={classes.dead} style={{ left: place(deadZone), right: place(deadZone) }} />
        <span className={classes.raw} style={{ left: place(-raw) }} data-testid="raw" />
        <span className={classes.result} style={{ left: place(result) }} data-testid="result" />
      </span>
    </div>
  )
}

interface FineProps {
  name: string
  label: string
  of: keyof typeof AXIS_LIMITS
  axis: AxisMapping
  set: (change: Partial<AxisMapping>) => void
  step: number
}

function Fine({ name, label, of, axis, set, step }: FineProps) {
  const { least, most } = AXIS_LIMITS[of]
  const value = axis[of]
  return (
    <div className={classes.fine}>
      <Text size="xs" c="dimmed">
        {label} <b>{of === 'exponent' ? value.toFixed(1) : `${Math.round(value * 100)} %`}</b>
      </Text>
      <Slider
        size="sm"
        min={least}
        max={most}
        step={step}
        value={value}
        onChange={(next) => set({ [of]: next })}
        label={null}
        thumbLabel={name}
      />
    </div>
  )
}
