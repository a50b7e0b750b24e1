/** Which events of control are worth a notice, and what it says. Who pressed a button sees the button change: no notice. */
import type { ControlEvent } from '@mosaic/client'
import { nameOf, resourceSuffix, stopTakenText, takerOf, whyText } from './controlText'

export interface ControlNotice {
  tone: 'good' | 'bad'
  title: string
  text: string
  /** How long it stays; what took control away stays until it is read. */
  shownMs: number | null
}

const NEWS_MS = 6000

/** Null: nothing to say. `wasWaiting`: the grant comes after a wait, so that the person may be looking elsewhere. */
export function noticeOf(event: ControlEvent, wasWaiting: boolean): ControlNotice | null {
  switch (event.type) {
    case 'granted':
      if (!wasWaiting) return null
      return { tone: 'good', title: `You have control${resourceSuffix(event.resource)}.`, text: 'It was handed to you.', shownMs: NEWS_MS }
    case 'denied':
      return { tone: 'bad', title: 'Not granted.', text: whyText(event), shownMs: NEWS_MS }
    case 'lost':
      if (event.code === 'lease.handed_over') return null
      return { tone: 'bad', title: `You no longer have control${resourceSuffix(event.resource)}.`, text: whyText(event), shownMs: null }
    case 'cleared':
      return { tone: 'good', title: 'The stop was cleared.', text: 'Commands act again.', shownMs: NEWS_MS }
    case 'stopRight':
      return stopRightNotice(event)
    case 'queued':
    case 'asked':
    case 'stopped':
      return null
  }
}

function stopRightNotice({ of, mayStop, by }: ControlEvent & { type: 'stopRight' }): ControlNotice {
  const who = takerOf({ stopRightBy: by })
  const tone = mayStop ? 'good' : 'bad'
  if (!of.isMe) {
    const text = mayStop ? `${who} gave the right to stop back.` : `${who} took the right to stop.`
    return { tone, title: `${nameOf(of)} ${mayStop ? 'may stop this robot again.' : 'may no longer stop this robot.'}`, text, shownMs: NEWS_MS }
  }
  if (mayStop) return { tone, title: 'You may stop this robot again.', text: `${who} gave the right back.`, shownMs: NEWS_MS }
  return { tone, title: 'You may no longer stop this robot.', text: stopTakenText(of), shownMs: null }
}
