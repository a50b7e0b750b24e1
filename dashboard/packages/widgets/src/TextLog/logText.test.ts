import { expect, test } from 'vitest'
import { logTextOf } from './logText'

const bytes = (text: string) => new TextEncoder().encode(text).buffer

test.each([
  ['{"level":"warn","name":"gripper","message":"It is hot."}', 'WARN gripper: It is hot.'],
  ['{"level":"info","message":"Ready."}', 'INFO Ready.'],
  ['{"message":"Only words."}', 'Only words.'],
  ['{"level":"info"}', '{"level":"info"}'],
  ['no JSON', 'no JSON'],
])('%s reads as %s', (sent, shown) => expect(logTextOf(bytes(sent))).toBe(shown))
