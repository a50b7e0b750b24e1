export type { BulkLaneState } from './BulkLane'
export { browserPlatform } from './browserPlatform'
export { timelineJson, type Timeline, type TimelineMark } from './ConnectionTimeline'
export { nowMs } from './clock'
export { FIRST_FRAME_TIMEOUT_MS, firstFrameCode, type Received } from './firstFrame'
export { resourceOf } from './control/clearance'
export { ControlDesk } from './control/ControlDesk'
export type * from './control/views'
export { DATA_TYPES, readConnectorConfig, writeConnectorConfig } from './described/connectorConfig'
export { describedCatalogue, describedEntry, driveOf, parallelNumOf, typeOf } from './described/describedCatalogue'
export { connectorsInTabs, type TabConnector } from './described/dashboardTabs'
export { guessOf, type Guess } from './described/guess'
export { DeliveryWatch, type DeliveryRows } from './delivery/DeliveryWatch'
export { StoreCounters } from './delivery/StoreCounters'
export { MosaicClient, type MosaicClientOptions } from './MosaicClient'
export { MosaicError } from './MosaicError'
export { nearestName } from './nearestName'
export type { Platform } from './Platform'
export { randomId } from './randomId'
export { Value, type Readable } from './Readable'
export type { ConnectionGrant, DashboardTab, NewRobot, PairingSecret, RestApi, ServerInfo } from './RestApi'
export { RobotConnection } from './RobotConnection'
export type { StoreClass, StoreMatch } from './StoreClasses'
export { StoreManager } from './StoreManager'
export { BidirectionalStore } from './stores/BidirectionalStore'
export { ConnectionCheckingStore } from './stores/ConnectionCheckingStore'
export { MediaStreamStore, type MediaStatistics, type ShownPicture } from './stores/MediaStreamStore'
export { MosaicStore, type ConnectionListener, type LifecycleEvent, type StoreType } from './stores/MosaicStore'
export type { Sendable } from './stores/OutgoingPort'
export { ReceivableStore, type DataListener } from './stores/ReceivableStore'
export { SendableStore } from './stores/SendableStore'
export { TalkStore, type Talker, type VoiceLine } from './stores/TalkStore'
export { pageTicks, timerTicks, type Ticks } from './Ticks'
export type * from './types'
// The words of the wire that a widget needs, so that it has one package to import from.
export { MOMENT_TITLES, ORIGINAL_TYPES, reasonOf, RobotStatus } from '@mosaic/protocol'
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
} from '@mosaic/protocol'
