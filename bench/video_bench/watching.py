"""A page in Chromium that watches one track, and what it can say about it."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any

OFFER = """async () => {
  const peer = (window.peer = new RTCPeerConnection())
  peer.addTransceiver('video', { direction: 'recvonly' })
  const video = document.body.appendChild(document.createElement('video'))
  Object.assign(video, { muted: true, autoplay: true, playsInline: true })
  window.shown = []
  const note = (_, frame) => {
    window.shown.push([performance.timeOrigin + frame.expectedDisplayTime, frame.rtpTimestamp])
    video.requestVideoFrameCallback(note)
  }
  peer.ontrack = (event) => {
    video.srcObject = new MediaStream([event.track])
    void video.play()
    video.requestVideoFrameCallback(note)
  }
  await peer.setLocalDescription()
  if (peer.iceGatheringState !== 'complete')
    await new Promise((done) => {
      peer.onicegatheringstatechange = () => peer.iceGatheringState === 'complete' && done()
      setTimeout(done, 1500)
    })
  return peer.localDescription.sdp
}"""
ACCEPT = "(sdp) => peer.setRemoteDescription({ type: 'answer', sdp })"
STATISTICS = """async () => {
  for (const entry of (await peer.getStats()).values())
    if (entry.type === 'inbound-rtp')
      return { freezes: entry.freezeCount ?? 0, frozen_s: entry.totalFreezesDuration ?? 0,
        decoded: entry.framesDecoded ?? 0, size_bytes: entry.bytesReceived ?? 0, height: entry.frameHeight ?? 0 }
}"""
_TICKS = 1 << 32


@dataclass(frozen=True, slots=True)
class Moment:
    """What the page says now."""

    freezes: int
    frozen_s: float
    decoded: int
    size_bytes: int
    height: int
    at_s: float


async def moment(page: Any) -> Moment:
    return Moment(**await page.evaluate(STATISTICS), at_s=time.monotonic())


async def ages_ms(page: Any, origin: int) -> list[float]:
    """The age of every picture at its display, since the last call: display time minus capture time."""
    shown = await page.evaluate("() => window.shown.splice(0)")
    to_wall_s, now_ticks = time.time() - time.monotonic(), int(time.monotonic() * 90_000)
    ages = []
    for displayed_ms, rtp in shown:
        captured_ticks = now_ticks - (now_ticks - (rtp - origin)) % _TICKS
        ages.append(displayed_ms - (captured_ticks / 90_000 + to_wall_s) * 1000)
    return ages
