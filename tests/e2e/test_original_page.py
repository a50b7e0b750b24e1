"""A page that knows the original's documents alone, in a real Chromium, with a robot of ours behind our server: it
finds everything through `connectorConfig`, shows it, and drives.

It does what the original page does: REST with the original's bodies, `/ws/user` with its messages, one bare channel or
one video line per connector of the configuration.
"""

from __future__ import annotations

from typing import Any

import pytest
from playwright.sync_api import Browser

pytestmark = pytest.mark.e2e

CONNECTORS = """\
  - { type: sim-camera, label: front, params: { fps: 10 } }
  - { type: sim-pose, label: pose, params: { period_s: 0.05 } }
  - { type: sim-battery, label: battery }
  - { type: sim-laser-scan, label: scan }
  - { type: sim-point-cloud, label: cloud }
  - { type: cmd-vel, label: cmd_vel, params: { drive: { type: sim } }, safety: { timeout_s: 0.3 } }
  - { type: connection-check, label: link }
"""
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


@pytest.fixture(scope="module")
def robot(start_robot: Any) -> Any:
    return start_robot(CONNECTORS)


def test_an_original_page_shows_and_drives_a_robot_of_ours(
    robot: Any, browser: Browser, server: Any, seed: Any
) -> None:
    page = browser.new_context(bypass_csp=True).new_page()
    page.set_default_timeout(30_000)
    errors: list[str] = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.goto(f"{server.url}/healthz")  # an answer of the server's own: Chromium lets no made-up page speak to loopback
    page.set_content(PAGE)
    page.evaluate("([name, password]) => connect(name, password)", [seed.email, seed.password])
    page.wait_for_function(
        "() => ['pose', 'battery', 'scan', 'cloud-0', 'link-sender'].every((label) => seen.messages[label])"
    )
    page.wait_for_function("() => document.querySelector('video').videoWidth > 0")
    start = page.evaluate("() => seen.pose")
    page.evaluate("() => { seen.drives = true }")
    page.wait_for_function(
        "(start) => JSON.stringify(seen.pose.position) !== JSON.stringify(start.position)", arg=start
    )
    seen = page.evaluate("() => seen")
    assert seen["tab"].keys() == {"id", "name", "widgets"}
    assert seen["session"].keys() == {"robotId", "rtcSessionId"}
    assert seen["stream"] == "front"
    assert seen["stores"] == {
        "front": "MediaStreamStore",
        "pose": "JsonReceivableStore",
        "battery": "JsonReceivableStore",
        "scan": "JsonReceivableStore",
        "cloud": "PointCloudStore",
        "cmd_vel": "ThumbstickToTwistStore",
        "link-receiver": "ConnectionCheckSenderStore",
        "link-sender": "ConnectionCheckReceiverStore",
    }
    assert set(seen["answered"]) <= {
        "signaling.send_sdp_answer", "signaling.exchange_ice_candidate", "ping.ping", "status.update",
    }  # fmt: skip
    assert errors == []
    page.context.close()
