/** What a widget says of itself: which connectors it can show, how well, and where on the page it belongs. */
import type { CatalogueEntry, Direction, Kind, MosaicDataType } from '@mosaic/client'
import type { ComponentType } from 'react'
import type { AnyStore } from '../stores/storeKinds'

/** What the component of a widget gets. */
export interface WidgetProps {
  robotId: string
  entry: CatalogueEntry
  store: AnyStore
}

/** A widget as data: the dashboard needs nothing else to offer it. */
export interface WidgetDefinition {
  /** Equals the catalogue's widget hint. */
  id: string
  title: string
  icon: ComponentType<{ size?: number | string; stroke?: number }>
  accepts: Acceptance
  /** `picture` leads the page, `control` is within reach of the thumb, `panel` is everything else. */
  area: 'picture' | 'control' | 'panel'
  /** Columns (of 12) and rows (of 64 px) that it likes. */
  size: { columns: number; rows: number }
  Component: ComponentType<WidgetProps>
}

/** Which connectors a widget shows, and why; `fitOf` compares it with what the robot announces. */
export interface Acceptance {
  dataTypes: readonly MosaicDataType[]
  kinds?: readonly Kind[]
  directions?: readonly Direction[]
  /** Other spellings of the hint, beside the widget's id. */
  hints?: readonly string[]
  /** Schema ids of the messages that it was made for: standard ones, or a plugin's own (`acme/Grip@1`). */
  schemas?: readonly string[]
  /** Connector types that it was made for, where a robot gives neither hint nor schema. */
  connectorTypes?: readonly string[]
  /** Field paths; a schema that has all paths of one list is understood. */
  fields?: readonly (readonly string[])[]
  /** Sends what a connector takes and shows what it sends, where a connector says of both what they are. */
  bothWays?: boolean
  /** Shows numbers alone: it can't show messages whose schema has none, whoever asks for it. */
  numbers?: boolean
  /** Shows anything of its data types. */
  anything?: boolean
  /** Between widgets that fit equally well the higher one wins. */
  priority: number
}
