export type { BulkLaneState } from './peers/BulkConnection'
export { browserPlatform } from './platform/browserPlatform'
export { timelineJson, type Timeline, type TimelineMark } from './peers/ConnectionTimeline'
export { nowMs } from './timing/clock'
export { FIRST_FRAME_TIMEOUT_MS, firstFrameCode, type Received } from './stores/firstFrame'
export { resourceOf } from './control/clearance'
export { ControlDesk } from './control/ControlDesk'
export type * from './words/views'
export { DATA_TYPES, readConnectorConfig, writeConnectorConfig } from './described/connectorConfig'
export { describedCatalogue, describedEntry, driveOf, parallelNumOf, typeOf } from './described/describedCatalogue'
export { connectorsInTabs, type TabConnector } from './described/dashboardTabs'
export { guessOf, type Guess } from './described/guess'
export { DeliveryWatch, type DeliveryRows } from './delivery/DeliveryWatch'
export { StoreCounters } from './delivery/StoreCounters'
export { MosaicClient, type MosaicClientOptions } from './MosaicClient'
export { MosaicError } from './words/MosaicError'
export { nearestName } from './words/nearestName'
export type { Platform } from './platform/Platform'
export { randomId } from './platform/randomId'
export { Value, type Readable } from './platform/Readable'
export type { ConnectionGrant, DashboardTab, NewRobot, PairingSecret, RestApi, ServerInfo, WidgetOffer } from './signaling/RestApi'
export { RobotConnection } from './RobotConnection'
export type { StoreClass, StoreMatch } from './stores/StoreClasses'
export { answerPatienceMs, RequestCaller, type RequestOptions } from './requests/RequestCaller'
export { StoreManager } from './stores/StoreManager'
export { BidirectionalStore } from './stores/BidirectionalStore'
export { ConnectionCheckingStore } from './stores/ConnectionCheckingStore'
export { MediaStreamStore, type MediaStatistics, type Shown, type ShownPicture } from './stores/MediaStreamStore'
export { MosaicStore, type ConnectionListener, type LifecycleEvent, type StoreType } from './stores/MosaicStore'
export type { Sendable } from './stores/OutgoingPort'
export { ReceivableStore, type DataListener } from './stores/ReceivableStore'
export { SendableStore } from './stores/SendableStore'
export { TalkStore, type Talker, type VoiceLine } from './stores/TalkStore'
export { pageTicks, timerTicks, type Ticks } from './timing/Ticks'
export { entryFor } from './words/entryFor'
export { siblingsOf } from './words/siblingsOf'
export type * from './words/types'
// The words of the wire that a widget needs, so that it has one package to import from.
export { messages, MOMENT_TITLES, ORIGINAL_TYPES, plainText, reasonOf, RobotStatus, WIDGET_HINTS } from '@mosaic/protocol'
export type {
  Catalogue,
  CatalogueEntry,
  Delivery,
  DescribedConnector,
  DriveCommand,
  OriginalType,
  DeliveryRow,
  Finding,
  Direction,
  JournalEntry,
  Kind,
  LeaseWaiting,
  MosaicDataType,
  PeerInfo,
  Reason,
  Refusal,
  SafetyCause,
  SafetyLimit,
  WidgetModule,
} from '@mosaic/protocol'
