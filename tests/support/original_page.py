"""A page that knows the original's documents alone, as an original dashboard does: REST with the original's bodies,
`/ws/user` with its messages, one bare channel or one video line per connector of the robot's `connectorConfig`.
"""

from __future__ import annotations

from typing import Any

from playwright.sync_api import Browser, Page

PAGE = """\
<!doctype html><title>original</title><video autoplay muted playsinline></video><script>
let accessToken
async function call(method, path, body) {
  const headers = { 'Content-Type': 'application/json' }
  if (accessToken) headers.Authorization = `Bearer ${accessToken}`
  const response = await fetch(path, { method, headers, body: body && JSON.stringify(body) })
  const answer = await response.json()
  if (answer.resultCode !== undefined && answer.resultCode !== 100) throw new Error(JSON.stringify(answer))
  return answer.resultData ?? answer
}

function authorized(socket) {
  return new Promise((resolve) => {
    socket.onmessage = ({ data: text }) => {
      const { type, data } = JSON.parse(text)
      if (type === 'authorize.req') socket.send(JSON.stringify({ type: 'authorize', data: { accessToken } }))
      if (type === 'authorize.res' && data === 100) resolve()
    }
  })
}

const seen = { stores: {}, messages: {}, answered: [], pose: null }

function opened(connection, { connectorId, connectorType, params }) {
  seen.stores[connectorId] = connectorType
  if (connectorType === 'MediaStreamStore') return connection.addTransceiver('video')
  const labels = [...Array(params?.parallelNum ?? 0).keys()].map((n) => `${connectorId}-${n}`)
  for (const label of labels.length ? labels : [connectorId]) heard(connection.createDataChannel(label), connectorType)
}

function heard(channel, connectorType) {
  channel.binaryType = 'arraybuffer'
  channel.onmessage = ({ data }) => {
    seen.messages[channel.label] = typeof data === 'string' ? data : `${data.byteLength} bytes`
    if (channel.label === 'pose') seen.pose = JSON.parse(data)
  }
  channel.onopen = () => {
    if (connectorType === 'ConnectionCheckSenderStore')
      setInterval(() => channel.send(JSON.stringify({ messageCreated: Date.now() })), 500)
    if (connectorType === 'ThumbstickToTwistStore') {
      const twist = { linear: { x: 0.2, y: 0, z: 0 }, angular: { x: 0, y: 0, z: 0.6 } }
      setInterval(() => seen.drives && channel.send(JSON.stringify(twist)), 30)
    }
  }
}

async function connect(username, password) {
  accessToken = (await call('POST', '/api/v1/account/login/access-token', { username, password })).accessToken
  const tabs = await call('GET', '/api/v1/dashboard/tabs')
  seen.tab = await call('GET', `/api/v1/dashboard/tabs/${tabs[0].id}`)
  const robot = (await call('GET', '/api/v1/robots?skip=0&limit=100')).data[0]
  const socket = new WebSocket(`ws://${location.host}/ws/user`)
  await authorized(socket)
  const connection = new RTCPeerConnection({ iceServers: await call('GET', '/api/v1/webrtc/ice-servers') })
  connection.ontrack = ({ streams: [stream] }) => {
    document.querySelector('video').srcObject = stream
    seen.stream = stream.id
  }
  for (const connector of JSON.parse(robot.connectorConfig).connectors) opened(connection, connector)
  const { sessions } = await call('POST', '/api/v1/webrtc/connection', { robotIds: [robot.id] })
  seen.session = sessions[0]
  const rtcConnectionId = sessions[0].rtcSessionId
  const say = (type, data) => socket.send(JSON.stringify({ type, data: { rtcConnectionId, ...data } }))
  connection.onicecandidate = ({ candidate }) => {
    if (!candidate?.candidate) return
    const { sdpMid, sdpMLineIndex } = candidate
    say('signaling.exchange_ice_candidate', { iceCandidate: { candidate: candidate.candidate, sdpMid, sdpMLineIndex } })
  }
  socket.onmessage = async ({ data: text }) => {
    const { type, data } = JSON.parse(text)
    seen.answered.push(type)
    if (type === 'ping.ping') socket.send(JSON.stringify({ type: 'ping.pong', data: { pingId: data.pingId } }))
    const answer = { type: 'answer', sdp: data.sdpAnswer }
    if (type === 'signaling.send_sdp_answer') await connection.setRemoteDescription(answer)
    if (type === 'signaling.exchange_ice_candidate') await connection.addIceCandidate(data.iceCandidate)
  }
  await connection.setLocalDescription(await connection.createOffer())
  say('signaling.send_sdp_offer', { sdpOffer: connection.localDescription.sdp })
}
</script>"""


def connected_page(browser: Browser, server: Any, seed: Any, errors: list[str]) -> Page:
    """The page, connecting to the seeded robot. Its ``seen`` has what came; ``errors`` get what it throws."""
    page = browser.new_context(bypass_csp=True).new_page()
    page.set_default_timeout(30_000)
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.goto(f"{server.url}/healthz")  # an answer of the server's own: Chromium lets no made-up page speak to loopback
    page.set_content(PAGE)
    page.evaluate("([name, password]) => connect(name, password)", [seed.email, seed.password])
    return page
