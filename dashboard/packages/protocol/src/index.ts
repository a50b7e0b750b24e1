export * from './framing'
export {
  CHANNEL_PROTOCOL,
  CHUNK_PAYLOAD_BYTES,
  CloseCode,
  CONTROL_EXTENSIONS,
  CONTROL_LABEL,
  CONTROL_PROTOCOL_VERSION,
  EXTENSIONS,
  HEADER_BYTES,
  HELLO_TIMEOUT_MS,
  LANE_LABEL,
  LEASE_KEEP_PERIOD_MS,
  MAX_MESSAGE_BYTES,
  MEDIA_SEEN_PERIOD_MS,
  MOMENT_TITLES,
  PayloadKind,
  PEER_LOST_AFTER_MS,
  PING_PERIOD_MS,
  REASONS,
  ResultCode,
  RobotStatus,
  STOP_LABEL,
  STOP_REPEAT_MS,
  WIDGET_HINTS,
} from './generated'
export type * from './generated'
/** The standard messages: an interface for each, and `SCHEMA_IDS`. */
export * as messages from './generatedMessages'
export * from './generatedOriginalTypes'
export * from './messages'
export { plainText } from './plainText'
export * from './reasons'
export { Partials } from './reassembly'
export { parseCatalogue, parseIceServers } from './restParts'
export { WireError } from './WireError'
