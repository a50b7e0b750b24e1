// An original page and an original robot against the browser's own names alone (RTCPeerConnection, WebSocket, fetch):
// Chromium runs it as it stands, Node with the names of node-datachannel's polyfill (libdatachannel).
// Every method takes and returns what JSON can carry, as whoever tests calls it from outside.

const WAIT_MS = 20_000

async function until(condition, what, seen = () => '') {
  const end = performance.now() + WAIT_MS
  while (!condition()) {
    if (performance.now() > end) throw new Error(`after ${WAIT_MS} ms still not true: ${what}${seen()}`)
    await new Promise((resolve) => setTimeout(resolve, 10))
  }
}

class Wire {
  constructor(url) {
    this.url = url
    this.said = []
    this.isAuthorized = false
    this.turn = Promise.resolve()
  }

  async open(path) {
    this.socket = new WebSocket(this.url.replace('http', 'ws') + path)
    await new Promise((resolve, reject) => {
      this.socket.onopen = resolve
      this.socket.onerror = () => reject(new Error(`no socket ${path}`))
      this.socket.onmessage = (event) => {
        const { type, data } = JSON.parse(event.data)
        this.said.push([type, data])
        this.turn = this.turn.then(() => this.heard(type, data)).catch((error) => console.error(String(error)))
      }
    })
    await until(() => this.isAuthorized, 'authorized')
  }

  say(type, data) {
    if (this.socket?.readyState === 1) this.socket.send(JSON.stringify({ type, data }))
  }
}

const bare = ({ candidate, sdpMid, sdpMLineIndex }) => ({ candidate, sdpMid, sdpMLineIndex: sdpMLineIndex ?? 0 })

async function certificates(algorithm) {
  if (!algorithm) return undefined
  const modulus = { modulusLength: 2048, publicExponent: new Uint8Array([1, 0, 1]), hash: 'SHA-256' }
  return [await RTCPeerConnection.generateCertificate({ name: 'RSASSA-PKCS1-v1_5', ...modulus })]
}

export class Page extends Wire {
  calls = {}

  async logIn(username, password) {
    const { accessToken } = await this.rest('POST', '/api/v1/account/login/access-token', { username, password })
    this.token = accessToken
    await this.open('/ws/user')
  }

  async rest(method, path, body) {
    const headers = { 'Content-Type': 'application/json', ...(this.token && { Authorization: `Bearer ${this.token}` }) }
    const answer = await fetch(this.url + path, { method, headers, body: body && JSON.stringify(body) })
    const envelope = await answer.json()
    if (!answer.ok || envelope.resultCode !== 100) throw new Error(`${method} ${path}: ${JSON.stringify(envelope)}`)
    return envelope.resultData
  }

  async heard(type, data) {
    const call = this.calls[data?.rtcConnectionId]
    if (type === 'authorize.req') this.say('authorize', { accessToken: this.token })
    else if (type === 'authorize.res') this.isAuthorized = data === 100
    else if (type === 'ping.ping') this.say('ping.pong', { pingId: data.pingId })
    else if (type === 'signaling.send_sdp_answer') {
      call.answer = data.sdpAnswer
      await call.pc.setRemoteDescription({ type: 'answer', sdp: data.sdpAnswer })
      call.isAnswered = true
    } else if (type === 'signaling.exchange_ice_candidate')
      await call.pc.addIceCandidate(data.iceCandidate).catch(() => (call.rejected += 1)) // no queue before the answer
  }

  statuses(robotId) {
    return this.said.filter(([type, data]) => type === 'status.update' && data.robotId === robotId).map(([, d]) => d.status)
  }

  async waitReady(robotId) {
    this.say('status.subscribe', { robotIds: [robotId] })
    await until(() => this.statuses(robotId).at(-1) === 0, 'the robot is ready')
  }

  /**
   * `codec`: offer this one alone for video; `rsa`: with a certificate of RSA; `hides`: tell no address before the
   * answer is taken. Returns the call's id.
   */
  async call(robotId, labels, { videos = 0, codec = null, rsa = false, hides = false, waits = true } = {}) {
    const { sessions } = await this.rest('POST', '/api/v1/webrtc/connection', { robotIds: [robotId] })
    const id = sessions[0].rtcSessionId
    const pc = new RTCPeerConnection({ iceServers: [], ...(rsa && { certificates: await certificates('rsa') }) })
    const call = { id, pc, channels: {}, received: {}, streams: [], videos: [], rejected: 0, answer: '', askedAt: performance.now() }
    this.calls[id] = call
    for (const label of labels) this.openChannel(call, label)
    for (let i = 0; i < videos; i++) only(pc.addTransceiver('video'), codec)
    pc.ontrack = ({ track, streams }) => this.trackArrived(call, track, streams)
    const early = [] // a candidate must not overtake the offer
    let isOffered = false
    const send = (candidate) => this.say('signaling.exchange_ice_candidate', { rtcConnectionId: id, iceCandidate: bare(candidate) })
    pc.onicecandidate = ({ candidate }) => {
      if (candidate?.candidate) isOffered ? send(candidate) : early.push(candidate)
    }
    const offer = await pc.createOffer()
    await pc.setLocalDescription(offer)
    const { sdp } = pc.localDescription
    const sdpOffer = hides ? sdp.replace(/^a=(candidate|end-of-candidates).*\r\n/gm, '') : sdp
    this.say('signaling.send_sdp_offer', { rtcConnectionId: id, sdpOffer })
    if (hides) await until(() => call.isAnswered, 'the answer is taken')
    isOffered = true
    early.forEach(send)
    if (waits) {
      const seen = () => `, but ${JSON.stringify(this.state(call))}`
      await until(() => pc.connectionState === 'connected', 'the call is connected', seen)
      await until(() => Object.values(call.channels).every((it) => it.readyState === 'open'), 'all channels are open', seen)
    }
    return id
  }

  state({ pc, channels, answer, rejected }) {
    const { connectionState, iceConnectionState, iceGatheringState, signalingState } = pc
    const labels = Object.entries(channels).map(([label, { readyState }]) => [label, readyState])
    return { connectionState, iceConnectionState, iceGatheringState, signalingState, labels, rejected, answer }
  }

  openChannel(call, label) {
    const channel = call.pc.createDataChannel(label)
    channel.binaryType = 'arraybuffer'
    call.channels[label] = channel
    call.received[label] = []
    channel.onmessage = ({ data }) => call.received[label].push(typeof data === 'string' ? data : `bytes:${data.byteLength}`)
  }

  trackArrived(call, track, streams) {
    call.streams.push(streams[0]?.id ?? '')
    const video = document.createElement('video')
    video.muted = true
    video.srcObject = new MediaStream([track])
    video.requestVideoFrameCallback(() => (call.firstPictureMs ??= performance.now() - call.askedAt))
    document.body.append(video)
    void video.play().catch(() => undefined)
    call.videos.push(video)
  }

  connectionState(id) {
    return this.calls[id].pc.connectionState
  }

  streams(id) {
    return this.calls[id].streams
  }

  answer(id) {
    return this.calls[id].answer
  }

  firstPictureMs(id) {
    return this.calls[id].firstPictureMs ?? null
  }

  received(id, label) {
    return this.calls[id].received[label]
  }

  send(id, label, text) {
    this.calls[id].channels[label].send(text)
  }

  /** One round of the connection check; must come back letter by letter. */
  async check(id, label = 'link') {
    const call = this.calls[id]
    const stamp = JSON.stringify({ messageCreated: performance.timeOrigin + performance.now() })
    const seen = call.received[`${label}-sender`].length
    call.channels[`${label}-receiver`].send(stamp)
    await until(() => call.received[`${label}-sender`].length > seen, 'the echo')
    if (call.received[`${label}-sender`].at(-1) !== stamp) throw new Error('the echo is another text')
    return (performance.timeOrigin + performance.now() - JSON.parse(stamp).messageCreated) / 2
  }

  /** How many pixels changed between two pictures of a call's video: a moving picture, not a still or black one. */
  async motion(id, index = 0) {
    const video = this.calls[id].videos[index]
    await until(() => video.videoWidth > 0, 'a picture')
    const first = pixels(video)
    const start = video.currentTime
    await until(() => video.currentTime > start + 0.3, 'the picture goes on')
    const second = pixels(video)
    return first.reduce((sum, value, i) => sum + (Math.abs(value - second[i]) > 30 ? 1 : 0), 0)
  }

  hangUp(id) {
    this.say('signaling.close_peer_connection', { rtcConnectionId: id })
    this.calls[id].pc.close()
  }

  close() {
    for (const call of Object.values(this.calls)) call.pc.close()
    this.socket?.close()
  }
}

function only(transceiver, codec) {
  if (!codec) return
  const known = RTCRtpReceiver.getCapabilities('video').codecs
  transceiver.setCodecPreferences(known.filter((it) => it.mimeType === codec))
}

function pixels(video) {
  const canvas = Object.assign(document.createElement('canvas'), { width: 64, height: 48 })
  const context = canvas.getContext('2d')
  context.drawImage(video, 0, 0, 64, 48)
  return [...context.getImageData(0, 0, 64, 48).data].filter((_, i) => i % 4 === 1)
}

/** A robot as the C++ library behaves: `pose`, `cmd_vel`, `link` and, where there is a canvas, cameras by label. */
export class Robot extends Wire {
  state = 0
  statuses = []
  twists = []
  protocols = {}
  channels = {}

  async start(robotId, token, { cameras = [], rsa = false } = {}) {
    Object.assign(this, { robotId, token, cameras, rsa })
    const opened = this.open('/ws/robot')
    await until(() => this.socket.readyState === 1, 'the socket is open')
    this.report()
    await opened
  }

  report() {
    this.statuses.push(this.state)
    this.say('status.update', { status: this.state })
  }

  set(state) {
    this.state = state
    this.report()
  }

  async heard(type, data) {
    if (type === 'authorize.req') this.say('authorize', { robotId: this.robotId, ...(this.token && { data: this.token }) })
    else if (type === 'authorize.res') this.isAuthorized = data === 100
    else if (type === 'ping.ping') this.say('ping.pong', data)
    else if (type === 'signaling.prepare_connection') this.connectionId = data.rtcConnectionId
    else if (type === 'signaling.send_sdp_offer') await this.offered(data.sdpOffer)
    else if (type === 'signaling.exchange_ice_candidate') await this.pc?.addIceCandidate(data.iceCandidate)
    else if (type === 'signaling.close_peer_connection' && this.state === 2) this.end()
  }

  async offered(sdp) {
    if (this.state === 2) this.end()
    if (this.state !== 0) return
    this.set(1)
    const pc = new RTCPeerConnection({ iceServers: [], ...(this.rsa && { certificates: await certificates('rsa') }) })
    this.pc = pc
    pc.ondatachannel = ({ channel }) => this.channelArrived(channel)
    pc.onconnectionstatechange = () => this.stateChanged(pc)
    pc.onicecandidate = ({ candidate }) => {
      if (!candidate?.candidate) return
      const data = { rtcConnectionId: this.connectionId, iceCandidate: bare(candidate) }
      this.say('signaling.exchange_ice_candidate', data)
    }
    await pc.setRemoteDescription({ type: 'offer', sdp })
    const labels = await this.bindCameras(pc)
    await pc.setLocalDescription(await pc.createAnswer())
    const sdpAnswer = named(pc.localDescription.sdp, labels)
    this.say('signaling.send_sdp_answer', { rtcConnectionId: this.connectionId, sdpAnswer })
  }

  async bindCameras(pc) {
    const labels = {}
    if (!this.cameras.length) return labels
    const lines = pc.getTransceivers().filter((it) => it.receiver.track.kind === 'video')
    for (const [index, label] of this.cameras.entries()) {
      if (!lines[index]) break
      await lines[index].sender.replaceTrack(movingSquare())
      lines[index].direction = 'sendonly'
      labels[lines[index].mid] = label
    }
    return labels
  }

  stateChanged(pc) {
    if (pc !== this.pc) return
    if (pc.connectionState === 'connected' && this.state === 1) this.set(2)
    if (['failed', 'disconnected', 'closed'].includes(pc.connectionState) && this.state === 2) this.end()
  }

  end() {
    this.set(3)
    const pc = this.pc
    this.pc = undefined
    clearInterval(this.posing)
    this.channels = {}
    pc?.close()
    this.set(0)
  }

  channelArrived(channel) {
    const { label, protocol } = channel
    this.protocols[label] = protocol
    const known = ['pose', 'cmd_vel', 'link-receiver', 'link-sender']
    if (!known.includes(label) || this.channels[label]) return
    this.channels[label] = channel
    channel.binaryType = 'arraybuffer'
    if (label === 'pose') this.posing = setInterval(() => this.pose(channel), 100)
    channel.onmessage = ({ data }) => {
      if (label === 'cmd_vel') {
        const { linear = {}, angular = {} } = JSON.parse(typeof data === 'string' ? data : new TextDecoder().decode(data))
        this.twists.push([linear.x ?? 0, angular.z ?? 0])
      } else if (label === 'link-receiver') this.channels['link-sender']?.send(data)
    }
  }

  pose(channel) {
    if (channel.readyState !== 'open') return
    const position = { x: (performance.now() / 1000) % 10, y: 1.5, z: 0 }
    channel.send(JSON.stringify({ position, orientation: { x: 0, y: 0, z: 0, w: 1 }, timestamp: Date.now() * 1000 }, null, '\t'))
  }

  look() {
    const { state, statuses, twists, protocols } = this
    return { state, statuses, twists, protocols }
  }

  close() {
    if (this.state === 2) this.end()
    this.set(5)
    this.socket?.close()
  }
}

/** A browser invents stream ids; the original robot's are its labels. */
function named(sdp, labels) {
  return sdp
    .split(/(?=^m=)/m)
    .map((section) => {
      const label = labels[/^a=mid:(\S+)/m.exec(section)?.[1]]
      if (!label) return section
      const line = `a=msid:${label} ${label}`
      return /^a=msid:/m.test(section) ? section.replace(/^a=msid:.*?$/m, line) : `${section}${line}\r\n`
    })
    .join('')
}

function movingSquare() {
  const canvas = Object.assign(document.createElement('canvas'), { width: 320, height: 240 })
  const context = canvas.getContext('2d')
  let count = 0
  setInterval(() => {
    context.fillStyle = '#282828'
    context.fillRect(0, 0, 320, 240)
    context.fillStyle = '#ebebeb'
    context.fillRect((count++ * 6) % 260, 90, 60, 60)
  }, 50)
  return canvas.captureStream(20).getVideoTracks()[0]
}
