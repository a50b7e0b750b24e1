/** What stands beside the button. */
import { reasonOf, type Refusal, type Talker } from '@mosaic/client'
import type { TalkPhase } from './TalkSession'

export interface TalkView {
  phase: TalkPhase
  problem: string
  talker: Talker | null
  refusal: Refusal | null
  /** This page's peer; null while unknown. */
  ownPeerId: string | null
}

export type TalkTone = 'plain' | 'heard' | 'warn'

export function talkText({ phase, problem, talker, refusal, ownPeerId }: TalkView): { tone: TalkTone; text: string } {
  if (problem !== '') return { tone: 'warn', text: problem }
  const hasFloor = talker !== null && talker.peerId === ownPeerId
  // Who had to wait is heard once the other one has ended; a loudspeaker that fails plays nobody.
  const isRefused = refusal !== null && !(hasFloor && refusal.code === 'media.talk_busy')
  if (phase === 'talking' && isRefused) {
    return { tone: 'warn', text: `Not heard: ${refusal.message ?? reasonOf(refusal.code).sentence}` }
  }
  if (phase === 'talking' && hasFloor) return { tone: 'heard', text: 'You are heard' }
  if (talker !== null && !hasFloor) {
    return { tone: 'plain', text: `${talker.name === '' ? 'Somebody' : talker.name} is talking` }
  }
  if (phase === 'asking') return { tone: 'plain', text: 'Waiting for the microphone' }
  return { tone: 'plain', text: phase === 'talking' ? 'Speak' : 'Nobody is talking' }
}
