/** What to do with the gamepad that is connected, in one line. */
import type { ActiveGamepad } from './GamepadSource'
import { buttonName } from './gamepadMapping'

export function gamepadHint({ name, kind, mapping, isTrusted }: ActiveGamepad): string {
  if (!isTrusted) return `${name} is not known here: look at its mapping once, then it drives.`
  const isStandard = kind.mapping === 'standard'
  const stop = mapping.stopButton === null ? '' : ` ${capital(buttonName(mapping.stopButton, isStandard))} stops the robot.`
  if (!mapping.needsDeadMan) return `${name} drives with its sticks.${stop}`
  if (mapping.deadManButton === null) return `${name} has no dead-man button chosen and does not drive.${stop}`
  return `${name}: hold ${buttonName(mapping.deadManButton, isStandard)} to drive.${stop}`
}

function capital(text: string): string {
  return text.charAt(0).toUpperCase() + text.slice(1)
}
