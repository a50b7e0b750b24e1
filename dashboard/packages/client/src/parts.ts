/**
 * The parts of this package that the other end of a connection is made of, too: a robot that is a page. They are ours alone,
 * and no promise to pages; what those use is in `index.ts`.
 */
export { DataPort, type PortMessage } from './delivery/DataPort'
export { ChannelPartials } from './delivery/ChannelPartials'
export { RemoteCandidates } from './peers/RemoteCandidates'
export { guarded, Listeners } from './platform/Readable'
export { RestApi } from './signaling/RestApi'
export { SignalingSession, type SignalingEffect, type SignalingEvent } from './signaling/signalingSession'
export { SignalingSocket } from './signaling/SignalingSocket'
export { microseconds, wallClockMs } from './timing/clock'
export { MachineDriver, type DeadlinePassed, type Machine } from './timing/MachineDriver'
export { usableIceServers } from './words/iceServers'
export { plainCandidate } from './words/rtcWords'
