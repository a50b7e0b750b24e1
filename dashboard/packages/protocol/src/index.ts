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
  MAX_MESSAGE_BYTES,
  PayloadKind,
  PEER_LOST_AFTER_MS,
  PING_PERIOD_MS,
  REASONS,
  ResultCode,
  RobotStatus,
} from './generated'
export type * from './generated'
export * from './messages'
export * from './reasons'
export { parseCatalogue, parseIceServers } from './restParts'
export { WireError } from './WireError'
