import { useReadable, useRobotConnection } from '@mosaic/react'
import { Notice } from '../frame/Notice'
import type { WidgetProps } from '../registry/WidgetDefinition'
import { isObject } from '../schema/jsonSchema'
import { formatted } from '../schema/messageFields'
import { jsonOf } from '../stores/decode'
import { useLatest } from '../stores/useReceived'
import { targetOfJoint } from './jointPairs'
import { isOutside, jointsOf, rangeOf, shareOf, type Joint, type JointRange } from './joints'
import classes from './Joints.module.css'

/** A line for each joint: where it stands within its limits, how fast it moves, how hard it works. */
export function Joints({ robotId, entry, store }: WidgetProps) {
  const latest = useLatest(store)
  const entries = useReadable(useRobotConnection(robotId).catalogue)?.entries ?? []
  const decoded = latest === null ? null : jsonOf(latest.data)
  if (decoded === null) return <Notice tone="wait" title="No joints yet" />
  const joints = decoded.ok ? jointsOf(decoded.value) : null
  if (joints === null && decoded.ok && isEmpty(decoded.value)) return <Notice tone="wait" title="No joints" />
  if (joints === null) return <Notice tone="bad" title="Not the state of joints">It has names, each once, and positions.</Notice>
  const has = (key: 'velocity' | 'effort') => joints.some((joint) => joint[key] !== null)
  const [hasVelocity, hasEffort] = [has('velocity'), has('effort')]
  const ranges = joints.map(({ name }) => rangeOf(targetOfJoint(entries, entry, name)?.safety, `positions.${name}`))
  const hasPlace = ranges.some((range) => shareOf(0, range) !== null)
  return (
    <div className={classes.scroll} tabIndex={0} role="region" aria-label={`Joints of ${entry.label}`}>
      <table className={classes.table}>
        <thead>
          <tr>
            <th scope="col">Joint</th>
            <th scope="col" title="Sliding joints: m">Position (rad)</th>
            {hasPlace && (
              <th scope="col">
                <span className={classes.hidden}>Within its limits</span>
              </th>
            )}
            {hasVelocity && <th scope="col">rad/s</th>}
            {hasEffort && <th scope="col">Nm</th>}
          </tr>
        </thead>
        <tbody>
          {joints.map((joint, index) => (
            <Row key={joint.name} joint={joint} range={ranges[index] ?? NO_RANGE} {...{ hasPlace, hasVelocity, hasEffort }} />
          ))}
        </tbody>
      </table>
    </div>
  )
}

/** Whether a message says that there are none. */
function isEmpty(message: unknown): boolean {
  const names = isObject(message) ? (message['names'] ?? message['name']) : null
  return Array.isArray(names) && names.length === 0
}

const NO_RANGE: JointRange = { min: null, max: null }

interface RowProps {
  joint: Joint
  range: JointRange
  hasPlace: boolean
  hasVelocity: boolean
  hasEffort: boolean
}

function Row({ joint, range, hasPlace, hasVelocity, hasEffort }: RowProps) {
  return (
    <tr data-outside={isOutside(joint.position, range)}>
      <th scope="row">{joint.name}</th>
      <td>{formatted(joint.position)}</td>
      {hasPlace && (
        <td className={classes.place}>
          <PlaceBar name={joint.name} position={joint.position} range={range} />
        </td>
      )}
      {hasVelocity && <td>{formatted(joint.velocity)}</td>}
      {hasEffort && <td>{formatted(joint.effort)}</td>}
    </tr>
  )
}

/** Where a joint stands between its ends; nothing where it has none. */
function PlaceBar({ name, position, range }: { name: string; position: number | null; range: JointRange }) {
  const share = shareOf(position, range)
  if (share === null || position === null) return null
  const words = `${formatted(position)} of ${formatted(range.min)} to ${formatted(range.max)}`
  return (
    <div
      className={classes.bar}
      role="meter"
      aria-label={`${name} within its limits`}
      aria-valuemin={range.min ?? undefined}
      aria-valuemax={range.max ?? undefined}
      aria-valuenow={Math.min(range.max ?? position, Math.max(range.min ?? position, position))}
      aria-valuetext={words}
      title={words}
    >
      <span className={classes.mark} style={{ insetInlineStart: `${100 * share}%` }} />
    </div>
  )
}
