import type { ControlMessages } from '@mosaic/protocol'
import type { ControlDesk, ControlEvent, MosaicClient } from '@mosaic/client'
import { act, cleanup, fireEvent, render, screen } from '@testing-library/react'
import { afterEach, describe, expect, test, vi } from 'vitest'
import { MosaicProvider, useControl, useControlEvents, useLease, useLimits, useStop } from '../src/index'
import { offlineClient } from './offlineClient'

afterEach(cleanup)

/** The robot's word. */
function hears<T extends keyof ControlMessages>(desk: ControlDesk, type: T, data: ControlMessages[T]): void {
  act(() => desk.heard({ type, data } as Parameters<ControlDesk['heard']>[0]))
}

function met(): { client: MosaicClient; desk: ControlDesk } {
  const client = offlineClient()
  const { control: desk } = client.connection('r')
  desk.greeted({ lease: 1, stop: 1 })
  return { client, desk }
}

const ADA = { peerId: 'ada', name: 'Ada', role: 'operator', isPerson: true, isOriginal: false } as const
const EVE = { ...ADA, peerId: 'eve', name: 'Eve' }

describe('hooks of control', () => {
  test('show who is there and who commands', () => {
    const { client, desk } = met()
    function Page() {
      const { availability, me, peers, leases } = useControl('r')
      return <p>{`${availability} ${me?.name ?? 'nobody'} ${peers.length} ${leases.motion?.holder?.name ?? 'free'}`}</p>
    }
    render(<MosaicProvider client={client}><Page /></MosaicProvider>)
    expect(screen.getByText('available nobody 0 free')).toBeDefined()
    hears(desk, 'peers', { you: 'ada', peers: [ADA, EVE] })
    hears(desk, 'lease.state', { resource: 'motion', epoch: 4, holder: EVE, queue: [], expiryS: 2 })
    expect(screen.getByText('available Ada 2 Eve')).toBeDefined()
  })

  test('a lease is taken, answered and given back by its buttons', () => {
    const { client, desk } = met()
    const buttons = new Set<unknown>()
    const answer = vi.spyOn(desk, 'answerLease')
    function Page() {
      const lease = useLease('r')
      buttons.add(lease.take).add(lease.release).add(lease.answer)
      return (
        <>
          <p>{lease.state}, {lease.request?.phase ?? 'no request'}</p>
          <button onClick={() => lease.take({ reason: 'tour' })}>take</button>
          <button onClick={() => lease.release()}>release</button>
          <button onClick={() => lease.answer('eve', true)}>answer</button>
        </>
      )
    }
    render(<MosaicProvider client={client}><Page /></MosaicProvider>)
    expect(screen.getByText('free, no request')).toBeDefined()
    hears(desk, 'peers', { you: 'ada', peers: [ADA] })
    fireEvent.click(screen.getByText('take'))
    expect(screen.getByText('free, asked')).toBeDefined()
    hears(desk, 'lease.state', { resource: 'motion', epoch: 4, holder: ADA, queue: [], expiryS: 2 })
    hears(desk, 'lease.reply', { resource: 'motion', outcome: 'granted', epoch: 4, code: '' })
    expect(screen.getByText('mine, no request')).toBeDefined()
    fireEvent.click(screen.getByText('answer'))
    expect(answer).toHaveBeenCalledWith('motion', 'eve', true, undefined)
    fireEvent.click(screen.getByText('release'))
    expect(screen.getByText('free, no request')).toBeDefined()
    expect(buttons.size).toBe(3)
  })

  test('the stop shows, and how far my own has come', async () => {
    const { client, desk } = met()
    function Page() {
      const { isStopped, by, mine, stop } = useStop('r')
      return <button onClick={() => void stop('child')}>{`${isStopped ? `stopped by ${by}` : 'runs'}, ${mine?.phase ?? 'none'}`}</button>
    }
    render(<MosaicProvider client={client}><Page /></MosaicProvider>)
    expect(screen.getByText('runs, none')).toBeDefined()
    // Nothing is connected in this test: nobody heard it, and the page says so.
    await act(async () => {
      fireEvent.click(screen.getByRole('button'))
      await Promise.resolve()
    })
    expect(screen.getByText('runs, unconfirmed')).toBeDefined()
    hears(desk, 'stop.state', { isStopped: true, by: 'Eve', reason: '' })
    expect(screen.getByText('stopped by Eve, unconfirmed')).toBeDefined()
  })

  test('a limit shows under its label', () => {
    const { client, desk } = met()
    function Page() {
      return <p>{useLimits('r', 'cmd_vel')?.factor ?? 'full speed'}</p>
    }
    render(<MosaicProvider client={client}><Page /></MosaicProvider>)
    expect(screen.getByText('full speed')).toBeDefined()
    hears(desk, 'safety.limit', { label: 'cmd_vel', factor: 0.5, causes: [] })
    hears(desk, 'safety.limit', { label: 'other', factor: 0.1, causes: [] })
    expect(screen.getByText('0.5')).toBeDefined()
  })

  test('events reach the listener of the latest render, until the page is gone', () => {
    const { client, desk } = met()
    const heard: [string, ControlEvent['type']][] = []
    function Page({ name }: { name: string }) {
      useControlEvents('r', (event) => void heard.push([name, event.type]))
      return null
    }
    const page = (name: string) => <MosaicProvider client={client}><Page name={name} /></MosaicProvider>
    const { rerender, unmount } = render(page('first'))
    rerender(page('second'))
    hears(desk, 'stop.state', { isStopped: true, by: '', reason: '' })
    unmount()
    hears(desk, 'stop.state', { isStopped: false, by: '', reason: '' })
    expect(heard).toEqual([['second', 'stopped']])
  })
})
