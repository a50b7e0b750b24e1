import { messages, type CatalogueEntry } from '@mosaic/client'
import fc from 'fast-check'
import { describe, expect, test } from 'vitest'
import { reportedJoints, reportsFor, takenNames, targetOfJoint, type Heard } from './jointPairs'
import type { Joint } from './joints'

const { JointState, JointTarget } = messages.SCHEMA_IDS
const TARGET: CatalogueEntry = { label: 'arm', type: 'x', kind: 'data', dataType: 'json-u2r', direction: 'to-robot', channels: [], delivery: 'latest', schemaId: JointTarget }
const REPORT: CatalogueEntry = { ...TARGET, dataType: 'json-r2u', direction: 'to-operator', schemaId: JointState }

const target = (label: string, itemNames?: readonly string[], connector?: string): CatalogueEntry => ({ ...TARGET, label, itemNames, connector })
const report = (label: string, connector?: string): CatalogueEntry => ({ ...REPORT, label, connector })
const at = (position: number, ...names: string[]): Joint[] => names.map((name) => ({ name, position, velocity: null, effort: null }))
const shown = (entries: readonly CatalogueEntry[], heard: Heard, of: CatalogueEntry) =>
  reportedJoints(reportsFor(entries, of), heard, of).map(({ name, position }) => [name, position])

const BOTH = { left_joints: at(1, 'base', 'lift'), right_joints: at(2, 'base', 'lift') }

describe('two arms with joints of equal names', () => {
  test('of two connectors each show their own', () => {
    const left = target('left', ['base', 'lift'], 'left')
    const right = target('right', ['base', 'lift'], 'right')
    const rightJoints = report('right_joints', 'right')
    const entries = [left, report('left_joints', 'left'), right, rightJoints]
    expect(shown(entries, BOTH, left)).toEqual([['base', 1], ['lift', 1]])
    expect(shown(entries, BOTH, right)).toEqual([['base', 2], ['lift', 2]])
    expect(targetOfJoint(entries, rightJoints, 'base')).toBe(right)
  })

  test.each(['robot', undefined])('of one connector (%s), or each handler of its own, go by how they are called', (connector) => {
    const left = target('left_arm', ['base', 'lift'], connector)
    const right = target('right_arm', ['base', 'lift'], connector)
    const leftJoints = report('left_joints', connector)
    const entries = [right, left, leftJoints, report('right_joints', connector)]
    expect(shown(entries, BOTH, left)).toEqual([['base', 1], ['lift', 1]])
    expect(shown(entries, BOTH, right)).toEqual([['base', 2], ['lift', 2]])
    expect(targetOfJoint(entries, leftJoints, 'base')).toBe(left)
  })

  test('show nothing where nothing tells them apart', () => {
    const arm = target('arm', ['base', 'lift'])
    expect(shown([arm, report('left_joints'), report('right_joints')], BOTH, arm)).toEqual([])
  })

  test('do not take the report of the other that has one', () => {
    const left = target('left', ['base', 'lift'])
    expect(shown([left, target('right', ['base', 'lift'], 'right'), report('right_joints', 'right')], BOTH, left)).toEqual([])
  })
})

test('a report of the whole body tells of each arm its own joints', () => {
  const [left, right] = [target('left', ['l1', 'l2']), target('right', ['r1'])]
  const entries = [left, right, report('joint_states')]
  const heard = { joint_states: at(0.5, 'r1', 'l1', 'l2', 'head') }
  expect(shown(entries, heard, left)).toEqual([['l1', 0.5], ['l2', 0.5]])
  expect(shown(entries, heard, right)).toEqual([['r1', 0.5]])
})

test('the report of the own connector tells also where it has some of the joints only', () => {
  const arm = target('arm', ['base', 'lift'], 'arm')
  const entries = [arm, report('arm_joints', 'arm'), report('all')]
  expect(shown(entries, { arm_joints: at(1, 'lift'), all: at(9, 'base', 'lift') }, arm)).toEqual([['lift', 1]])
})

test('of another connector it must have all of them', () => {
  const arm = target('arm', ['base', 'lift'])
  expect(shown([arm, report('all')], { all: at(9, 'base') }, arm)).toEqual([])
})

test('where no joint is named, the one report of the one arm tells, and none of several', () => {
  const arm = target('arm')
  expect(shown([arm, report('all')], { all: at(1, 'base') }, arm)).toEqual([['base', 1]])
  expect(shown([arm, report('all'), target('other')], { all: at(1, 'base') }, arm)).toEqual([])
  expect(shown([arm, report('all'), report('more')], { all: at(1, 'base') }, arm)).toEqual([])
})

test('limits name joints where nothing else does, and one arm has what the limits of all joints say', () => {
  const limited = { ...TARGET, safety: { limits: { 'positions.base': { min: 0 }, 'positions.*': { max: 1 } } } }
  expect(takenNames(limited)).toEqual(['base'])
  expect(shown([limited, report('all')], { all: at(1, 'head', 'base') }, limited)).toEqual([['base', 1]])
  expect(targetOfJoint([limited, report('all')], report('all'), 'head')).toBe(limited)
  expect(targetOfJoint([limited, target('b'), report('all')], report('all'), 'head')).toBeUndefined()
})

test('whatever reports there are, a joint that the command does not take is never shown', () => {
  const names = fc.uniqueArray(fc.constantFrom('a', 'b', 'c', 'd'), { minLength: 1 })
  const labels = fc.constantFrom(undefined, 'arm', 'other')
  fc.assert(
    fc.property(names, labels, fc.array(fc.tuple(labels, names), { maxLength: 4 }), (taken, connector, reports) => {
      const arm = target('arm', taken, connector)
      const entries = [arm, ...reports.map(([its], index) => report(`r${index}`, its))]
      const heard = Object.fromEntries(reports.map(([, its], index) => [`r${index}`, at(index, ...its)]))
      expect(shown(entries, heard, arm).every(([name]) => taken.some((one) => one === name))).toBe(true)
    }),
  )
})
