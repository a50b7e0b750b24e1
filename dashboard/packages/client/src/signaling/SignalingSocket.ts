import { parseSignaling, signalingText, WireError, type SignalingMessage, type SignalingMessages } from '@mosaic/protocol'
import type { Platform } from '../platform/Platform'
import { Listeners, Value, type Readable } from '../platform/Readable'
import { OperatorSignaling, type SignalingEffect, type SignalingEvent } from './operatorSignaling'
import type { ServerState } from '../words/types'
import { WakeTimer } from '../timing/WakeTimer'

/** The operator's WebSocket to the server. `OperatorSignaling` decides, this carries it out. */
export class SignalingSocket {
  private readonly session = new OperatorSignaling()
  private readonly serverState = new Value<ServerState>('offline')
  private readonly messages = new Listeners<[SignalingMessage]>()
  private readonly refusals = new Listeners<[string]>()
  private socket: WebSocket | null = null
  /** Whose status was asked for last: asked again, it is answered at once. */
  private robotIds: SignalingMessages['status.subscribe']['robotIds'] = []
  private readonly timer: WakeTimer

  readonly state: Readable<ServerState> = this.serverState

  constructor(
    private readonly url: string,
    private readonly platform: Platform,
  ) {
    this.timer = new WakeTimer(() => platform.now(), () => this.handle({ type: 'ticked' }))
    platform.onNetworkChange(() => {
      this.handle({ type: 'networkChanged' })
      this.doubt()
    })
  }

  start(token: string): void {
    this.handle({ type: 'started', token })
  }

  stop(): void {
    this.handle({ type: 'stopped' })
  }

  /** Ask for a sign of life: a socket whose network is gone does not know it, and is made anew at once. */
  doubt(): void {
    if (this.session.phase !== 'online') return
    this.send('status.subscribe', { robotIds: this.robotIds })
    this.handle({ type: 'doubted' })
  }

  /** Every message that is not the socket's own business. */
  onMessage(listener: (message: SignalingMessage) => void): () => void {
    return this.messages.add(listener)
  }

  /** The server does not take us; the socket rests until `start`. */
  onRefused(listener: (code: string) => void): () => void {
    return this.refusals.add(listener)
  }

  /** Send one message; false while not online. */
  send<T extends keyof SignalingMessages>(word: T, data: SignalingMessages[T]): boolean {
    if (word === 'status.subscribe') this.robotIds = (data as SignalingMessages['status.subscribe']).robotIds
    if (this.session.phase !== 'online' || this.socket === null) return false
    this.socket.send(signalingText(word, data))
    return true
  }

  private handle(event: SignalingEvent): void {
    const effects = this.session.handle(event, this.platform.now(), this.platform.random())
    for (const effect of effects) this.carryOut(effect)
    this.timer.set(this.session.wakeAtMs)
    this.serverState.set(this.session.state)
    // Told last, so that whoever hears it may send at once.
    for (const effect of effects) this.tell(effect)
  }

  private carryOut(effect: SignalingEffect): void {
    if (effect.type === 'open') this.open()
    else if (effect.type === 'close') this.close()
    else if (effect.type === 'send') this.socket?.send(signalingText(effect.word, effect.data))
  }

  private tell(effect: SignalingEffect): void {
    if (effect.type === 'tellMessage') this.messages.tell(effect.message)
    else if (effect.type === 'tellRefused') this.refusals.tell(effect.code)
  }

  private open(): void {
    const socket = this.platform.openWebSocket(this.url)
    this.socket = socket
    socket.onopen = () => this.handle({ type: 'opened' })
    socket.onclose = (event) => {
      this.socket = null
      this.handle({ type: 'closed', closeCode: event.code })
    }
    socket.onmessage = (event: MessageEvent<unknown>) => this.read(event.data)
  }

  private read(data: unknown): void {
    if (typeof data !== 'string') return
    try {
      this.handle({ type: 'heard', message: parseSignaling(data) })
    } catch (error) {
      if (!(error instanceof WireError)) throw error
      console.warn(`mosaic: the server sent something unreadable (${error.message})`)
    }
  }

  private close(): void {
    const { socket } = this
    if (socket === null) return
    this.socket = null
    socket.onopen = socket.onclose = socket.onmessage = null
    socket.close(1000)
  }
}
