import { RobotStatus, type RobotSummary } from '@mosaic/client'
import { expect, test } from 'vitest'
import { foundRobots, presenceOf } from './presence'
import { robotYaml } from './robotYaml'

const robot = (name: string, status: RobotStatus, isOnline = true): RobotSummary => ({
  id: `id-${name}`,
  name,
  description: `the ${name} one`,
  status,
  isOnline,
  authType: 1,
  organizationId: 'o',
})

test('every status number has a meaning', () => {
  for (const status of Object.values(RobotStatus)) expect(presenceOf({ status, isOnline: true }).text).not.toBe('')
  expect(presenceOf({ status: RobotStatus.READY_TO_CONNECT, isOnline: true }).kind).toBe('online')
  expect(presenceOf({ status: RobotStatus.RTC_CONNECTED, isOnline: true }).kind).toBe('busy')
})

test('a robot without a socket is offline, whatever it said last', () => {
  expect(presenceOf({ status: RobotStatus.READY_TO_CONNECT, isOnline: false }).kind).toBe('offline')
})

test('without the server nobody knows how a robot is', () => {
  expect(presenceOf({ status: RobotStatus.READY_TO_CONNECT, isOnline: false }, true).text).toBe('Unknown')
})

test('robots that can be used come first, then by name', () => {
  const robots = [robot('b', 5, false), robot('c', 0), robot('a', 2), robot('a2', 0)]
  expect(foundRobots(robots, '').map(({ name }) => name)).toEqual(['a2', 'c', 'a', 'b'])
})

test('every word of a search must be found', () => {
  const robots = [robot('kitchen', 0), robot('garden', 0)]
  expect(foundRobots(robots, 'the KITCH').map(({ name }) => name)).toEqual(['kitchen'])
  expect(foundRobots(robots, 'kitchen garden')).toEqual([])
})

test('the file for a new robot names this server over its socket', () => {
  const yaml = robotYaml('https://robots.example.org', { robotId: '7', token: 't' })
  expect(yaml).toContain('ws_url: wss://robots.example.org\n')
  expect(yaml).toContain('robot_id: 7')
})
