import { Button } from '@mantine/core'
import type { LeaseView, LeaseWaiting } from '@mosaic/client'
import { useControl, useLease } from '@mosaic/react'
import { IconHandClick } from '@tabler/icons-react'
import classes from './control.module.css'
import { resourceSuffix } from './controlText'

/** Whoever asks me for control, one card each. They take no focus and cover no pad; doing nothing hands over nothing. */
export function LeaseRequests({ robotId }: { robotId: string }) {
  const { leases } = useControl(robotId)
  return (
    <div className={classes.requests} aria-live="assertive" aria-relevant="additions" data-testid="lease-requests">
      {Object.values(leases)
        .filter(({ isMine }) => isMine)
        .flatMap((lease) => lease.queue.map((by) => <Asking key={`${lease.resource} ${by.peerId}`} robotId={robotId} lease={lease} by={by} />))}
    </div>
  )
}

function Asking({ robotId, lease, by }: { robotId: string; lease: LeaseView; by: LeaseWaiting }) {
  const { answer } = useLease(robotId, lease.resource)
  const name = by.name === '' ? (by.isPerson ? 'Somebody' : 'A program') : by.name
  return (
    <section className={classes.request} aria-label={`${name} asks for control`}>
      <IconHandClick size={20} aria-hidden />
      <span className={classes.requestText}>
        <strong>{name}</strong> asks for control{resourceSuffix(lease.resource)}
        {by.reason !== '' && <q>{by.reason}</q>}
      </span>
      <span className={classes.requestActions}>
        <Button size="sm" variant="default" onClick={() => answer(by.peerId, false)}>
          Not now
        </Button>
        <Button size="sm" onClick={() => answer(by.peerId, true)}>
          Hand over
        </Button>
      </span>
    </section>
  )
}
