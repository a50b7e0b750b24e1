import { parseSignaling, signalingText, WireError, type SignalingMessage, type SignalingMessages } from '@mosaic/protocol'
import type { Platform } from '../platform/Platform'
import { Listeners, Value, type Readable } from '../platform/Readable'
import { MachineDriver } from '../timing/MachineDriver'
import type { SignalingEffect, SignalingEvent, SignalingSession } from './signalingSession'
import type { ServerState } from '../words/types'

/** Keeps a WebSocket to the server. A machine of that side decides, this carries it out. */
export class SignalingSocket {
  private readonly driver: MachineDriver<SignalingEvent, SignalingEffect>
  private readonly serverState = new Value<ServerState>('offline')
  private readonly messages = new Listeners<[SignalingMessage]>()
  private readonly refusals = new Listeners<[string]>()
  private socket: WebSocket | null = null
  /** Whose status was asked for last: asked again, it is answered at once. */
  private robotIds: SignalingMessages['status.subscribe']['robotIds'] = []

  readonly state: Readable<ServerState> = this.serverState

  constructor(
    private readonly url: string,
    private readonly platform: Platform,
    private readonly machine: SignalingSession,
  ) {
    this.driver = new MachineDriver<SignalingEvent, SignalingEffect>(machine, platform, {
      // Set first: whoever hears that it is online may send at once.
      decided: () => this.serverState.set(machine.state),
      carryOut: (effect) => this.carryOut(effect),
    })
    platform.onNetworkChange(() => {
      this.driver.tell({ type: 'networkChanged' })
      this.doubt()
    })
  }

  start(token: string): void {
    this.driver.tell({ type: 'started', token })
  }

  stop(): void {
    this.driver.tell({ type: 'stopped' })
  }

  /** Ask for a sign of life: a socket whose network is gone does not know it, and is made anew at once. */
  doubt(): void {
    if (this.machine.phase !== 'online') return
    this.send('status.subscribe', { robotIds: this.robotIds })
    this.driver.tell({ type: 'doubted' })
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
    if (this.machine.phase !== 'online' || this.socket === null) return false
    this.socket.send(signalingText(word, data))
    return true
  }

  private carryOut(effect: SignalingEffect): void {
    switch (effect.type) {
      case 'open':
        return this.open()
      case 'close':
        return this.close()
      case 'send':
        return this.socket?.send(signalingText(effect.word, effect.data))
      case 'tellMessage':
        return this.messages.tell(effect.message)
      case 'tellRefused':
        return this.refusals.tell(effect.code)
    }
  }

  private open(): void {
    const socket = this.platform.openWebSocket(this.url)
    this.socket = socket
    socket.onopen = () => this.driver.tell({ type: 'opened' })
    socket.onclose = (event) => {
      this.socket = null
      this.driver.tell({ type: 'closed', closeCode: event.code })
    }
    socket.onmessage = (event: MessageEvent<unknown>) => this.read(event.data)
  }

  private read(data: unknown): void {
    if (typeof data !== 'string') return
    try {
      this.driver.tell({ type: 'heard', message: parseSignaling(data) })
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
