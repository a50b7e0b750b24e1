"""An operator whose message never ends, over real WebRTC: the robot keeps little of it, and is told to send it away."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any

import pytest
from aiortc import RTCConfiguration, RTCPeerConnection, RTCSessionDescription

from mosaic_core.adapters.aiortc_private.sctp.sctp_bounds import ALL_HELD, MAX_MESSAGE_BYTES
from mosaic_core.adapters.peers.aiortc_answerer import AiortcAnswerer

pytestmark = pytest.mark.webrtc
WAIT_S = 30.0


async def test_a_message_that_never_ends_costs_the_robot_little(side: Callable[[], Any]) -> None:
    robot_side, refused, held_bytes = side(), asyncio.Event(), list[int]()
    robot_side.bound_exceeded = lambda why: (held_bytes.append(ALL_HELD.size_bytes), refused.set())
    robot = AiortcAnswerer(robot_side, ())
    stranger = RTCPeerConnection(RTCConfiguration(iceServers=[]))
    try:
        async with asyncio.timeout(WAIT_S):
            channel, opened = stranger.createDataChannel("endless"), asyncio.Event()
            channel.on("open", opened.set)
            await stranger.setLocalDescription(await stranger.createOffer())
            answer = await robot.answer(stranger.localDescription.sdp, (), None)
            deaf = answer.replace("a=max-message-size:262144", "a=max-message-size:1000000000")
            assert deaf != answer
            await stranger.setRemoteDescription(RTCSessionDescription(deaf, "answer"))
            await opened.wait()
            channel.send(bytes(8 * MAX_MESSAGE_BYTES))  # its end is far away
            await refused.wait()
        assert held_bytes[0] < 2 * MAX_MESSAGE_BYTES
    finally:
        await asyncio.gather(stranger.close(), robot.close())
