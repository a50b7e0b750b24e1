"""The driver of the signaling session: order, closing handshake, and servers that hang."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest

from mosaic_core.machines.signaling import signaling_events as events
from mosaic_core.machines.signaling.peer_admission import PeerIdentity
from mosaic_core.machines.signaling.robot_signaling import RobotSignaling
from mosaic_core.runtime.signaling.signaling_socket import SignalingSocket
from mosaic_core.words.catalogue import Catalogue
from mosaic_core.words.signaling import SdpAnswer


def client(network: Any) -> tuple[SignalingSocket, list[events.Effect]]:
    effects: list[events.Effect] = []
    machine = RobotSignaling(
        events.RobotFacts("r1", "t", Catalogue.of(())), lambda ticket, prepared, keys: PeerIdentity("s"), lambda: 0.0
    )
    return SignalingSocket("ws://x/ws/robot", machine, network.connect, effects.append), effects


async def test_messages_leave_in_the_order_in_which_they_were_said(kit: Any) -> None:
    network = kit.network()
    it, _ = client(network)
    running = asyncio.create_task(it.run())
    socket = await network.ready()
    for number in range(100):
        it.tell(events.MessageReady(SdpAnswer(rtc_connection_id=str(number), sdp_answer="a")))
    it.tell(events.ShutdownBegun())
    await asyncio.wait_for(running, 30)
    answers = [data["rtcConnectionId"] for data in socket.got("signaling.send_sdp_answer")]
    assert answers == [str(number) for number in range(100)]
    assert socket.sent[-1] == {"type": "status.update", "data": {"status": 5}}
    assert socket.closed_by_robot == 1000


async def test_a_server_that_says_nothing_is_given_up_with_its_code(kit: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("mosaic_core.machines.signaling.signaling_session.GREETING_TIMEOUT_S", 0.05)

    network = kit.network()
    it, effects = client(network)
    running = asyncio.create_task(it.run())
    await kit.until(lambda: any(isinstance(effect, events.Report) for effect in effects))
    reports = [effect.code for effect in effects if isinstance(effect, events.Report)]
    assert reports == ["signal.timeout"]
    assert network.socket.closed_by_robot == 4408
    it.tell(events.ShutdownBegun())
    await asyncio.wait_for(running, 30)


async def test_a_closing_handshake_that_hangs_does_not_hold_the_robot(kit: Any) -> None:
    network = kit.network()
    it, _ = client(network)
    running = asyncio.create_task(it.run())
    socket = await network.ready()

    async def hang(code: int = 1000, reason: str = "") -> None:
        await asyncio.Event().wait()

    socket.close = hang
    it.tell(events.ShutdownBegun())
    await asyncio.wait_for(running, 1.5)


async def test_stop_while_waiting_for_the_next_attempt_ends_at_once(kit: Any) -> None:
    network = kit.network()
    network.is_down = True
    it, _ = client(network)
    running = asyncio.create_task(it.run())
    await kit.until(lambda: network.attempts == 1)
    it.tell(events.ShutdownBegun())
    await asyncio.wait_for(running, 0.3)
