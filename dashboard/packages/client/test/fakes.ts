/** Stand-ins for the browser: a server that a test scripts, peer connections that a test moves. */
import { CHANNEL_PROTOCOL, controlText, encodeFrame, FrameReader, PayloadKind, type ControlMessages } from '@mosaic/protocol'
import type { Platform } from '../src/platform/Platform'
import { timerTicks } from '../src/timing/Ticks'

type Handler<E> = ((event: E) => void) | null

export class FakeWebSocket {
  onopen: Handler<object> = null
  onclose: Handler<{ code: number }> = null
  onmessage: Handler<{ data: unknown }> = null
  readonly sent: { type: string; data: unknown }[] = []
  isClosed = false
  /** False: its network is gone, and it doesn't know. */
  answers = true

  constructor(readonly url: string) {}

  send(text: string): void {
    const message = JSON.parse(text) as { type: string; data: unknown }
    this.sent.push(message)
    // Whoever subscribes is answered at once; a word that nobody knows is a sign of life and nothing else.
    if (message.type === 'status.subscribe' && this.answers) queueMicrotask(() => this.says('test.heard', {}))
  }

  close(): void {
    this.isClosed = true
  }

  /** The server's word. */
  says(type: string, data: unknown): void {
    this.onmessage?.({ data: JSON.stringify({ type, data }) })
  }

  online(): this {
    this.onopen?.({})
    this.says('authorize.req', { extensions: { catalogue: 1, multiPeer: 1 } })
    this.says('authorize.res', 100)
    return this
  }

  sentOf(type: string): unknown[] {
    return this.sent.filter((message) => message.type === type).map(({ data }) => data)
  }
}

export class FakeDataChannel {
  onopen: (() => void) | null = null
  onclose: (() => void) | null = null
  onmessage: Handler<{ data: unknown }> = null
  onbufferedamountlow: (() => void) | null = null
  readyState = 'connecting'
  bufferedAmount = 0
  bufferedAmountLowThreshold = 0
  binaryType = 'blob'
  /** The other side hears what is sent. */
  onsent: ((data: string | Uint8Array) => void) | null = null
  readonly sent: (string | Uint8Array)[] = []
  private readonly reader = new FrameReader()
  private seq = 0

  constructor(
    readonly label: string,
    readonly options: RTCDataChannelInit = {},
  ) {}

  get protocol(): string {
    return this.options.protocol ?? ''
  }

  send(data: string | Uint8Array): void {
    if (this.readyState !== 'open') throw new Error('InvalidStateError')
    this.sent.push(data)
    this.onsent?.(data)
  }

  close(): void {
    this.readyState = 'closed'
  }

  opens(): this {
    this.readyState = 'open'
    this.onopen?.()
    return this
  }

  /** The other side closed it. */
  vanishes(): void {
    this.readyState = 'closed'
    this.onclose?.()
  }

  says(text: string, header: { stampUs?: number; latched?: boolean } = {}): void {
    const payload = new TextEncoder().encode(text)
    if (this.protocol !== CHANNEL_PROTOCOL) return this.onmessage?.({ data: text })
    this.seq += 1
    const frame = { kind: PayloadKind.JSON, payload, seq: this.seq, epoch: 0, stampUs: 0, latched: false, ...header }
    for (const message of encodeFrame(frame)) this.onmessage?.({ data: message.buffer })
  }

  control<T extends keyof ControlMessages>(type: T, data: ControlMessages[T]): void {
    this.says(controlText(type, data))
  }

  /** What was sent, without frames. */
  texts(): string[] {
    return this.sent.flatMap((data) => {
      if (typeof data === 'string') return [data]
      if (this.protocol !== CHANNEL_PROTOCOL) return [new TextDecoder().decode(data)]
      const frame = this.reader.read(data, 0)
      return frame === null ? [] : [new TextDecoder().decode(frame.payload)]
    })
  }

  controlSent(): { type: string; data: Record<string, unknown> }[] {
    return this.texts().map((text) => JSON.parse(text) as { type: string; data: Record<string, unknown> })
  }
}

export class FakeTransceiver {
  mid: string | null = null
  /** What this side sends, newest last. */
  readonly sentTracks: unknown[] = []
  readonly sender = {
    replaceTrack: (track: unknown): Promise<void> => {
      this.sentTracks.push(track)
      return Promise.resolve()
    },
  }

  constructor(
    readonly kind: string,
    readonly init: { direction?: string },
  ) {}
}

export class FakePeerConnection {
  onicecandidate: Handler<{ candidate: object | null }> = null
  oniceconnectionstatechange: (() => void) | null = null
  onconnectionstatechange: (() => void) | null = null
  ontrack: Handler<object> = null
  iceConnectionState = 'new'
  connectionState = 'new'
  localDescription: { sdp: string } | null = null
  remoteDescription: { sdp: string } | null = null
  readonly channels: FakeDataChannel[] = []
  readonly transceivers: FakeTransceiver[] = []
  readonly candidates: unknown[] = []
  isClosed = false
  rejectsAnswer = false

  constructor(readonly configuration: RTCConfiguration) {}

  getStats(): Promise<Map<string, unknown>> {
    return Promise.resolve(new Map<string, unknown>())
  }

  createDataChannel(label: string, options?: RTCDataChannelInit): FakeDataChannel {
    const channel = new FakeDataChannel(label, options)
    this.channels.push(channel)
    return channel
  }

  addTransceiver(kind: string, init: { direction?: string }): FakeTransceiver {
    const transceiver = new FakeTransceiver(kind, init)
    this.transceivers.push(transceiver)
    return transceiver
  }

  createOffer(): Promise<{ type: string; sdp: string }> {
    return Promise.resolve({ type: 'offer', sdp: 'offer-sdp' })
  }

  setLocalDescription(description: { sdp: string }): Promise<void> {
    this.localDescription = description
    this.transceivers.forEach((transceiver, index) => (transceiver.mid = String(index)))
    return Promise.resolve()
  }

  setRemoteDescription(description: { sdp: string }): Promise<void> {
    if (this.rejectsAnswer) return Promise.reject(new Error('bad sdp'))
    this.remoteDescription = description
    return Promise.resolve()
  }

  addIceCandidate(candidate: unknown): Promise<void> {
    if (this.remoteDescription === null) return Promise.reject(new Error('InvalidStateError'))
    this.candidates.push(candidate)
    return Promise.resolve()
  }

  close(): void {
    this.isClosed = true
  }

  /** The newest channel of this label. */
  channel(label: string): FakeDataChannel {
    const channel = this.channels.filter((one) => one.label === label).at(-1)
    if (!channel) throw new Error(`no channel ${label}`)
    return channel
  }

  finds(candidate: string): void {
    const found = { candidate, sdpMid: '0', sdpMLineIndex: 0, usernameFragment: 'secret' }
    this.onicecandidate?.({ candidate: candidate === '' ? null : found })
  }

  /** ICE, DTLS, control channel: all there. */
  links(): void {
    this.iceConnectionState = 'connected'
    this.oniceconnectionstatechange?.()
    this.connectionState = 'connected'
    this.onconnectionstatechange?.()
    this.channel('_mosaic').opens()
    this.channel('_stop').opens()
  }

  brings(mid: string | null, streamId?: string): FakeStream {
    const stream = { id: streamId ?? 'anonymous' }
    const streams = streamId === undefined ? [] : [stream]
    const receiver = { getStats: () => Promise.resolve(new Map()) }
    this.ontrack?.({ track: { id: 't' }, streams, receiver, transceiver: { mid } })
    return stream
  }
}

export interface FakeStream {
  id: string
}

export class FakeStorage implements Storage {
  private readonly items = new Map<string, string>()
  get length(): number {
    return this.items.size
  }
  clear(): void {
    this.items.clear()
  }
  getItem(key: string): string | null {
    return this.items.get(key) ?? null
  }
  key(index: number): string | null {
    return [...this.items.keys()][index] ?? null
  }
  removeItem(key: string): void {
    this.items.delete(key)
  }
  setItem(key: string, value: string): void {
    this.items.set(key, value)
  }
}

export type Route = (body: unknown, request: { url: string; headers: Record<string, string> }) => unknown

/** Thrown by a route: the server refuses. */
export class Refused extends Error {
  constructor(
    readonly status: number,
    readonly body: unknown,
  ) {
    super('refused')
  }
}

/** A browser whose clock is the fake timers' and whose server is a table of routes. */
export class FakePlatform implements Platform {
  readonly sockets: FakeWebSocket[] = []
  readonly peers: FakePeerConnection[] = []
  readonly requests: { method: string; path: string; body: unknown; headers: Record<string, string> }[] = []
  readonly routes: Record<string, Route> = {}
  localStorage: Storage | null = new FakeStorage()
  sessionStorage: Storage | null = new FakeStorage()
  visible = true
  readonly stoodStillMs: number[] = []
  private readonly listeners = { visibility: [], hide: [], show: [], network: [] } as Record<string, (() => void)[]>

  now = (): number => performance.now() + 1_000_000
  random = (): number => 1
  ticks = timerTicks

  fetch = async (input: unknown, init: RequestInit = {}): Promise<Response> => {
    const url = new URL(String(input))
    const method = init.method ?? 'GET'
    const body: unknown = typeof init.body === 'string' ? JSON.parse(init.body) : undefined
    const headers = init.headers as Record<string, string>
    this.requests.push({ method, path: url.pathname + url.search, body, headers })
    const route = this.routes[`${method} ${url.pathname}`]
    if (!route) return new Response('{"resultCode":10000}', { status: 404 })
    try {
      return new Response(JSON.stringify(await route(body, { url: url.href, headers })))
    } catch (error) {
      if (error instanceof Refused) return new Response(JSON.stringify(error.body), { status: error.status })
      throw error
    }
  }

  openWebSocket = (url: string): WebSocket => {
    const socket = new FakeWebSocket(url)
    this.sockets.push(socket)
    return socket as unknown as WebSocket
  }

  openPeerConnection = (configuration: RTCConfiguration): RTCPeerConnection => {
    const peer = new FakePeerConnection(configuration)
    this.peers.push(peer)
    return peer as unknown as RTCPeerConnection
  }

  newMediaStream = (track: MediaStreamTrack): MediaStream => ({ id: `of ${track.id}` }) as MediaStream
  isVisible = (): boolean => this.visible
  onVisibilityChange = (listener: () => void): void => this.on('visibility', listener)
  onPageHide = (listener: () => void): void => this.on('hide', listener)
  standStill = (ms: number): void => void this.stoodStillMs.push(ms)
  onPageShow = (listener: () => void): void => this.on('show', listener)
  onNetworkChange = (listener: () => void): void => this.on('network', listener)

  happens(what: 'visibility' | 'hide' | 'show' | 'network'): void {
    for (const listener of this.listeners[what] ?? []) listener()
  }

  get socket(): FakeWebSocket {
    return lastOf(this.sockets)
  }

  get peer(): FakePeerConnection {
    return lastOf(this.peers)
  }

  private on(what: string, listener: () => void): void {
    this.listeners[what]?.push(listener)
  }
}

function lastOf<T>(things: readonly T[]): T {
  const last = things.at(-1)
  if (last === undefined) throw new Error('none yet')
  return last
}

export function ok(resultData: unknown): unknown {
  return { resultCode: 100, resultData }
}
