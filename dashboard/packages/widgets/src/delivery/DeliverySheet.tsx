import { nowMs, type CatalogueEntry, type DeliveryRow, type StoreCounters } from '@mosaic/client'
import { ageOf, ageText } from '../stores/age'
import { receives, sends, showsMedia, type AnyStore } from '../stores/storeKinds'
import classes from './delivery.module.css'
import { failureText, PROMISES, queueText, rateText } from './deliveryText'
import { useDeliveryRow, useLocalDelivery, type LocalDelivery } from './useDelivery'

export interface DeliverySheetProps {
  robotId: string
  entry: CatalogueEntry
  store: AnyStore
}

/** How the data of one connector travels: what the robot counts, and what this page does. */
export function DeliverySheet({ robotId, entry, store }: DeliverySheetProps) {
  const row = useDeliveryRow(robotId, entry.label)
  const rates = useLocalDelivery(store)
  const isMedia = showsMedia(store)
  return (
    <>
      <table className={classes.sheet} aria-label={`Delivery of ${entry.label}`}>
        <caption>
          <strong>{entry.delivery}</strong>: {PROMISES[entry.delivery]}
        </caption>
        <thead>
          <tr>
            <th scope="col" />
            <th scope="col">robot</th>
            {!isMedia && <th scope="col">this page</th>}
          </tr>
        </thead>
        <tbody>
          {linesOf(row, store, rates).map(({ name, title, robot, here, isLoss }) => (
            <tr key={name} title={title}>
              <th scope="row">{name}</th>
              <Cell value={robot} isLoss={isLoss} />
              {!isMedia && <Cell value={here} isLoss={isLoss} />}
            </tr>
          ))}
        </tbody>
      </table>
      {row?.failureCode !== undefined && <p role="status">{failureText(row)}</p>}
      <p className={classes.hint}>{hintOf(row)}</p>
    </>
  )
}

function Cell({ value, isLoss }: { value: string | number | null; isLoss: boolean }) {
  const counts = isLoss && typeof value === 'number' && value > 0
  return <td data-counts={counts ? 'true' : undefined}>{value ?? '–'}</td>
}

function hintOf(row: DeliveryRow | undefined): string {
  return row === undefined
    ? 'This robot tells nothing about it, or is not connected.'
    : 'The robot counts for all operators together, since it started; its queue is the longest of any.'
}

interface Line {
  name: string
  title: string
  robot: string | number | null
  here: string | number | null
  isLoss: boolean
}

function linesOf(row: DeliveryRow | undefined, store: AnyStore, rates: LocalDelivery): Line[] {
  const { counters } = store
  const here = ownOf(store, rates)
  return [
    line('rate', 'Messages and bytes per second', row && rateText(row), here.rate),
    line('messages', 'Messages so far', row?.messages, here.messages),
    line('age', 'Of the last message', row && ageText(row.ageMs), here.age),
    line('queue', 'Messages that wait to leave', row && queueText(row.queueMessages, row.queueBytes), null),
    loss('replaced', 'A newer value took their place before they left', row?.replaced, here.sends(counters.replaced)),
    loss('queue full', 'Not taken, because too much was waiting', row?.dropped, here.sends(counters.refused)),
    loss('too large', 'Larger than a message may be', row?.tooLarge, null),
    loss('thinned', 'Held back by a rate limit', row?.thinned, null),
    loss('refused', 'Commands or input that the robot did not accept', row?.refused, null),
    loss('lost', 'Gone with a lost connection, or incomplete at its source', row?.lost, null),
    line('resent', 'Repeated after a lost connection', row?.resent, null),
    loss('missed', 'Their numbers never came: lost on the way, or replaced', null, here.receives(counters.missed)),
    loss('late', 'Came after a newer one', null, here.receives(counters.late)),
    loss('incomplete', 'Large messages of which parts never came', null, here.receives(counters.incomplete)),
  ].filter(({ robot, here: own }) => robot !== null || own !== null)
}

function line(name: string, title: string, robot: string | number | undefined | null, here: string | number | null): Line {
  return { name, title, robot: robot ?? null, here, isLoss: false }
}

function loss(name: string, title: string, robot: number | undefined | null, here: number | null): Line {
  return { ...line(name, title, robot, here), isLoss: true }
}

/** What this page knows, of a store that receives or only sends. */
function ownOf(store: AnyStore, rates: LocalDelivery) {
  const { counters }: { counters: StoreCounters } = store
  const isReceiving = receives(store)
  const latest = isReceiving ? store.latest : null
  return {
    rate: rateText(isReceiving ? rates.received : rates.sent),
    messages: isReceiving ? counters.received : counters.sent,
    age: latest === null ? null : ageText(ageOf(latest.info, nowMs())),
    sends: (count: number) => (sends(store) ? count : null),
    receives: (count: number) => (isReceiving ? count : null),
  }
}
