import { reasonOf, type CatalogueEntry, type Gap, type StoreState } from '@mosaic/client'
import { useRef, type ReactNode } from 'react'
import { failureText } from '../delivery/deliveryText'
import { DropMark } from '../delivery/DropMark'
import { useFailureCode } from '../delivery/useDelivery'
import { useAsPicture } from './usePictureInSight'
import type { WidgetDefinition } from '../registry/WidgetDefinition'
import { receives, sends, showsMedia, type AnyStore } from '../stores/storeKinds'
import { useConnectorStore } from '../stores/useConnectorStore'
import { useStoreState } from '../stores/useStoreState'
import { wholeSentence } from '../stores/wholeSentence'
import { AgeBadge } from './AgeBadge'
import { CardMenu } from './CardMenu'
import classes from './frame.module.css'
import { gapText } from './gapText'
import { LastPictureAge } from './LastPictureAge'
import { Notice } from './Notice'
import { useRecentGap } from './useRecentGap'
import { WidgetBoundary } from './WidgetBoundary'

/** Which connector of which robot a card shows, and by which widget. */
export interface WidgetCardProps {
  robotId: string
  entry: CatalogueEntry
  /** Null where no widget can show the connector. */
  widget: WidgetDefinition | null
  /** Widgets that could show it instead. */
  alternatives: readonly WidgetDefinition[]
  onChoose: (widgetId: string) => void
}

/** One connector on the page: its name, the age of its value, the state of its store, and the widget that shows it. */
export function WidgetCard({ robotId, entry, widget, alternatives, onChoose }: WidgetCardProps) {
  const store = useConnectorStore(robotId, entry.label, entry.dataType)
  const failureCode = useFailureCode(robotId, entry.label)
  const Icon = widget?.icon
  const body = useRef<HTMLDivElement>(null)
  useAsPicture(robotId, body, widget?.area === 'picture')
  return (
    <section className={classes.card} aria-label={`${entry.label}: ${widget?.title ?? 'no widget'}`} data-label={entry.label}>
      <header className={classes.header}>
        {Icon !== undefined && <Icon size={16} stroke={1.6} />}
        <h3 className={classes.label} title={`${entry.type} · ${entry.dataType} · ${entry.delivery}`}>
          {entry.label}
        </h3>
        {store !== null && <DropMark {...{ robotId, entry, store }} />}
        <span className={classes.spacer} />
        {store !== null && receives(store) && hasValue(entry) && <AgeBadge store={store} isFailing={failureCode !== undefined} />}
        <CardMenu {...{ robotId, entry, store, onChoose }} shown={widget} widgets={alternatives} />
      </header>
      <div ref={body} className={classes.body}>
        {widget === null ? <NoWidget entry={entry} /> : store !== null && <OpenWidget {...{ robotId, entry, store, widget, failureCode }} />}
      </div>
    </section>
  )
}

/** A connector that answers requests says nothing by itself. */
function hasValue(entry: CatalogueEntry): boolean {
  return entry.answerSchema === undefined
}

function NoWidget({ entry }: { entry: CatalogueEntry }) {
  return (
    <Notice tone="warn" title={`No widget shows ${entry.dataType}`}>
      The connector works all the same; a page of your own can use it through its store.
    </Notice>
  )
}

interface OpenWidgetProps {
  robotId: string
  entry: CatalogueEntry
  store: AnyStore
  widget: WidgetDefinition
  failureCode: string | undefined
}

function OpenWidget({ widget, failureCode, ...props }: OpenWidgetProps) {
  const state = useStoreState(props.store)
  const { Component } = widget
  if (state.phase === 'mismatch') return <Mismatch label={props.entry.label} state={state} />
  return (
    <WidgetBoundary key={widget.id} title={widget.title}>
      <div className={classes.content} data-away={state.phase === 'reconnecting' ? 'true' : undefined}>
        <Component {...props} />
      </div>
      <CardBar store={props.store} state={state} failureCode={failureCode} />
    </WidgetBoundary>
  )
}

/** A label that the robot doesn't know is said, never shown as an empty widget. */
export function Mismatch({ label, state, children }: { label: string; state: StoreState; children?: ReactNode }) {
  return (
    <Notice tone="bad" title={`The robot has no connector '${label}'`}>
      {state.nearest === undefined
        ? 'Compare the label with the one in the robot’s YAML file.'
        : `Did you mean '${state.nearest}'?`}
      {children}
    </Notice>
  )
}

interface CardBarProps {
  store: AnyStore
  state: StoreState
  failureCode: string | undefined
}

/** What is to be said about the channel, or what is at its other end; nothing most of the time. */
function CardBar({ store, state, failureCode }: CardBarProps) {
  const gap = useRecentGap(store)
  const text = barText(store, state, gap) ?? (failureCode === undefined ? null : failureText({ failureCode }))
  if (text === null) return null
  return (
    <div className={classes.bar} data-beside={receives(store) && !sends(store)} role="status">
      {text}
      {state.phase === 'reconnecting' && showsMedia(store) && (
        <>
          {' '}
          <LastPictureAge store={store} />
        </>
      )}
    </div>
  )
}

function barText(store: AnyStore, state: StoreState, gap: Gap | null): string | null {
  if (state.phase === 'closed' && state.code !== undefined) return closedText(state)
  // What has an age says so beside it.
  if (state.phase === 'reconnecting' && !receives(store)) return 'Reconnecting'
  return gap !== null && state.phase === 'open' ? gapText(gap) : null
}

function closedText(state: StoreState): string {
  const reason = reasonOf(state.code ?? '')
  return [wholeSentence(state.message ?? reason.sentence), reason.cure].filter((part) => part !== '').join(' ')
}
