/** What the tabs of original dashboards tell of a robot's connectors: their labels, and by the widget what travels there. Pure. */
import type { DescribedConnector } from '@mosaic/protocol'

/** A connector that a tab names, and what that tab is called. */
export interface TabConnector {
  connector: DescribedConnector
  tab: string
}

export interface WidgetTab {
  name: string
  /** JSON in a string: `{"widgets": […]}`. */
  widgets: string
}

/** Store class and widget of ours by the original's widget; with two connectors, the first one's store first. */
const STORES: Readonly<Record<string, readonly { store: string; widget?: string }[]>> = {
  ClearpathPlatformPowerViewer: [{ store: 'JsonReceivableStore', widget: 'value-cards' }],
  ConnectionCheck: [{ store: 'ConnectionCheckSenderStore' }, { store: 'ConnectionCheckReceiverStore' }],
  DelayCheck: [{ store: 'ConnectionCheckSenderStore' }, { store: 'ConnectionCheckReceiverStore' }],
  ImuState3DViewer: [{ store: 'JsonReceivableStore', widget: 'imu' }],
  JsonViewer: [{ store: 'JsonReceivableStore', widget: 'raw-json' }],
  LaserScanPolarViewer: [{ store: 'JsonReceivableStore', widget: 'laser-scan' }],
  MediaViewer: [{ store: 'MediaStreamStore' }],
  MediaViewerWithStat: [{ store: 'MediaStreamStore' }],
  ObjectDetectionMedia: [{ store: 'MediaStreamStore' }],
  SegmentationMedia: [{ store: 'MediaStreamStore' }],
  OpenStreetMapViewer: [{ store: 'JsonReceivableStore', widget: 'gps' }],
  PointCloud2DViewer: [{ store: 'PointCloudStore' }],
  PointCloud2DViewerV2: [{ store: 'ProgressivePointCloudStore' }],
  PointCloud3DViewer: [{ store: 'PointCloudStore' }],
  ThumbstickSender: [{ store: 'ThumbstickToTwistStore' }],
  WASDSender: [{ store: 'Ros2WasdToTwistStore' }],
}

/** The connectors of this robot, each once; widgets that we do not know tell nothing. */
export function connectorsInTabs(tabs: readonly WidgetTab[], robotId: string): TabConnector[] {
  const found = new Map<string, TabConnector>()
  for (const { name, widgets } of tabs) {
    for (const connector of widgetsIn(widgets).flatMap((widget) => connectorsOf(widget, robotId))) {
      if (!found.has(connector.connectorId)) found.set(connector.connectorId, { connector, tab: name })
    }
  }
  return [...found.values()]
}

function connectorsOf(widget: unknown, robotId: string): DescribedConnector[] {
  const { type, connectors } = (widget ?? {}) as { type?: unknown; connectors?: unknown }
  const stores = typeof type === 'string' && Object.hasOwn(STORES, type) ? STORES[type] : undefined
  if (stores === undefined || !Array.isArray(connectors)) return []
  return connectors.flatMap((one: unknown, index) => {
    const { robotId: owner, connectorId } = (one ?? {}) as { robotId?: unknown; connectorId?: unknown }
    const kind = stores[index]
    if (owner !== robotId || typeof connectorId !== 'string' || connectorId === '' || kind === undefined) return []
    return [{ connectorId, connectorType: kind.store, ...(kind.widget === undefined ? {} : { widget: kind.widget }) }]
  })
}

function widgetsIn(text: string): unknown[] {
  try {
    const { widgets } = (JSON.parse(text) ?? {}) as { widgets?: unknown }
    return Array.isArray(widgets) ? widgets : []
  } catch {
    return []
  }
}
