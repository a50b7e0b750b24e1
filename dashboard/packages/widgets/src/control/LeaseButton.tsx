import { Badge, Button, Popover, Stack, Text, Textarea, Tooltip, type ButtonProps } from '@mantine/core'
import type { LeaseView, PeerView } from '@mosaic/client'
import { useControl, useLease, useReadable, useRobotConnection } from '@mosaic/react'
import { IconEye, IconHourglassEmpty, IconSteeringWheel, IconUserCheck, IconUsers } from '@tabler/icons-react'
import { useId, useState, type SubmitEvent } from 'react'
import classes from './control.module.css'
import { leaseText, nameOf, resourceSuffix, shownLeases, type LeaseText } from './controlText'

const REASON_MAX = 200

type Take = (options?: { reason?: string; force?: boolean }) => boolean

/** One button per thing that can be commanded; most robots have one. Original robots know no lease and get none. */
export function LeaseButtons({ robotId }: { robotId: string }) {
  const { availability, leases } = useControl(robotId)
  const catalogue = useReadable(useRobotConnection(robotId).catalogue)
  if (availability !== 'available') return null
  return shownLeases(leases, catalogue).map((resource) => <LeaseButton key={resource} robotId={robotId} resource={resource} />)
}

/** Who has control, and the way to get it, give it back, or wait for it. */
export function LeaseButton({ robotId, resource }: { robotId: string; resource: string }) {
  const { me } = useControl(robotId)
  const lease = useLease(robotId, resource)
  const [isAsking, setIsAsking] = useState(false)
  const text = leaseText(lease, me)
  const act = { take: () => void lease.take(), ask: () => setIsAsking(!isAsking), release: lease.release, withdraw: lease.release }
  const isOpen = isAsking && text.action === 'ask'
  return (
    <Popover opened={isOpen} onChange={setIsAsking} position="bottom-end" shadow="lg" width={320} trapFocus returnFocus>
      <Popover.Target>
        <Tooltip label={text.hint} disabled={isOpen} openDelay={300} multiline maw={280}>
          <LeaseFace lease={lease} text={text} isOpen={isOpen} onPress={() => text.action !== null && act[text.action]()} />
        </Tooltip>
      </Popover.Target>
      <Popover.Dropdown>
        <AskForm lease={lease} me={me} take={lease.take} onDone={() => setIsAsking(false)} />
      </Popover.Dropdown>
    </Popover>
  )
}

interface LeaseFaceProps extends ButtonProps {
  lease: LeaseView
  text: LeaseText
  isOpen: boolean
  onPress: () => void
  ref?: React.Ref<HTMLButtonElement>
}

function LeaseFace({ lease, text, isOpen, onPress, ...rest }: LeaseFaceProps) {
  const { variant, color, Icon } = faceOf(lease, text)
  const waiting = lease.isMine ? lease.queue.length : 0
  return (
    <Button
      {...rest}
      className={classes.lease}
      classNames={{ label: classes.leaseLabel ?? '' }}
      data-state={lease.state}
      data-testid={`lease-${lease.resource}`}
      variant={variant}
      color={color}
      leftSection={<Icon size={18} stroke={1.8} aria-hidden />}
      rightSection={waiting > 0 ? <Badge circle color="orange" aria-label={`${waiting} waiting`}>{waiting}</Badge> : undefined}
      aria-disabled={text.action === null}
      aria-expanded={text.action === 'ask' ? isOpen : undefined}
      aria-description={text.hint}
      onClick={onPress}
    >
      {text.label}
      {resourceSuffix(lease.resource)}
    </Button>
  )
}

function faceOf({ state, request, holder }: LeaseView, { action }: LeaseText) {
  if (state === 'mine') return { variant: 'filled', color: 'signal', Icon: IconUserCheck }
  if (request !== null) return { variant: 'light', color: 'orange', Icon: IconHourglassEmpty }
  if (action === null) return { variant: 'default', color: 'gray', Icon: IconEye }
  if (state === 'free') return { variant: 'outline', color: 'signal', Icon: IconSteeringWheel }
  return { variant: 'default', color: 'gray', Icon: holder?.isPerson === true ? IconUsers : IconSteeringWheel }
}

interface AskFormProps {
  lease: LeaseView
  me: PeerView | null
  take: Take
  onDone: () => void
}

/** Ask whoever has control, or, as a supervisor and with a reason, take it over. */
function AskForm({ lease, me, take, onDone }: AskFormProps) {
  const [reason, setReason] = useState('')
  const [isMissing, setIsMissing] = useState(false)
  const field = useId()
  const name = nameOf(lease.holder)
  const isPerson = lease.holder?.isPerson === true
  const ask = (force: boolean) => {
    if (force && reason.trim() === '') {
      setIsMissing(true)
      document.getElementById(field)?.focus()
      return
    }
    take({ reason: reason.trim(), force })
    onDone()
  }
  const submit = (event: SubmitEvent<HTMLFormElement>) => {
    event.preventDefault()
    ask(false)
  }
  return (
    <form onSubmit={submit} aria-label={`Ask for control${resourceSuffix(lease.resource)}`}>
      <Stack gap="sm">
        <Text size="sm">
          <strong>{name}</strong> has control{resourceSuffix(lease.resource)}.{' '}
          {isPerson ? 'They are asked and decide.' : 'A person’s choice counts more than a program’s: you get it at once.'}
        </Text>
        <Textarea
          id={field}
          label="Reason"
          description={me?.role === 'supervisor' ? 'Needed to take over; shown to everybody' : 'Optional; shown to them'}
          value={reason}
          onChange={(event) => {
            setReason(event.currentTarget.value)
            setIsMissing(false)
          }}
          error={isMissing ? 'Say why you take over.' : undefined}
          maxLength={REASON_MAX}
          rows={2}
          data-autofocus
        />
        <Button type="submit">{isPerson ? `Ask ${name}` : `Take control from ${name}`}</Button>
        {me?.role === 'supervisor' && isPerson && (
          <Button variant="light" color="red" onClick={() => ask(true)}>
            Take over now
          </Button>
        )}
      </Stack>
    </form>
  )
}
