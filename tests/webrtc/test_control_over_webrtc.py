"""Lease and stop over real peer connections: two operators, one robot; the server is in memory."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import pytest

from mosaic_core import DataChannelJsonReceivable
from mosaic_core.contract.configurer import DataChannelConfigurer
from mosaic_core.contract.params import NoParams
from mosaic_core.laboratory.networks import WebRtcNetwork
from mosaic_core.operator.control.lease import LeaseDenied
from mosaic_core.testing import connector, joined, until
from mosaic_core.words.data_type import Delivery

pytestmark = pytest.mark.webrtc
WAIT_S = 30.0


class Wheels(DataChannelJsonReceivable):
    """``log``: what it was told, in order. ``hang`` keeps ``handle_data`` from returning."""

    delivery = Delivery.LATEST
    timeout_s = 5.0
    requires_lease = True

    def __init__(self, label: str) -> None:
        super().__init__(label)
        self.log: list[Any] = []
        self.free = threading.Event()
        self.free.set()

    def handle_data(self, data: dict[str, Any]) -> None:
        self.log.append(data["v"])
        self.free.wait(WAIT_S)

    def make_safe(self, cause: str) -> None:
        self.log.append(cause)


class WheelsConfigurer(DataChannelConfigurer[NoParams]):
    connector_type = "wheels"

    def configure(self) -> Wheels:
        return Wheels(self.label)


@asynccontextmanager
async def driven() -> AsyncIterator[tuple[Any, Wheels]]:
    drive = connector(WheelsConfigurer, label="drive")
    with WebRtcNetwork() as network:
        async with asyncio.timeout(4 * WAIT_S), joined(drive, takes_leases=True, network=network) as link:
            (wheels,) = link.configured.connectors[0].handlers
            assert isinstance(wheels, Wheels)
            yield link, wheels


async def test_one_drives_and_the_other_is_refused_until_the_lease_is_handed_over() -> None:
    async with driven() as (link, wheels):
        alice, bob = link.connection, await link.another_operator("Bob")
        drive, other = alice.sendable("drive"), bob.sendable("drive")
        await until(lambda: drive.send_json({"v": 1}) and wheels.log)
        other.send_json({"v": "bob"})
        await until(lambda: link.robot.snapshot().connectors[0].refused)
        with pytest.raises(LeaseDenied):
            await bob.control.take(wait_s=0.0)

        asking = asyncio.create_task(bob.control.take(reason="my turn", wait_s=WAIT_S))
        await until(lambda: [one.reason for one in alice.control.leases["motion"].queue] == ["my turn"])
        alice.control.answer(alice.control.leases["motion"].queue[0].peer_id, grant=True)
        await asking

        await until(lambda: "safety.lease_lost" in wheels.log)
        await until(lambda: other.send_json({"v": 2}) and 2 in wheels.log)
        drive.send_json({"v": "alice"})
        await until(lambda: link.robot.snapshot().connectors[0].refused > 1)
        assert not {"bob", "alice"} & set(wheels.log)


async def test_a_stop_beats_a_hanging_command_and_is_latched_until_a_person_clears_it() -> None:
    async with driven() as (link, wheels):
        alice, bob = link.connection, await link.another_operator("Bob")
        drive = alice.sendable("drive")
        wheels.free.clear()
        await until(lambda: drive.send_json({"v": 1}) and wheels.log)
        drive.send_json({"v": "queued"})

        report = await bob.control.stop("somebody walks in")
        assert report.is_safe
        assert (wheels.log[0], set(wheels.log[1:])) == (1, {"safety.stop"})

        wheels.free.set()
        await until(lambda: len(wheels.log) > 2)
        await until(lambda: alice.control.stop_state.is_stopped)
        drive.send_json({"v": "while stopped"})
        with pytest.raises(LeaseDenied):
            await bob.control.clear_stop()
        told: list[str] = []
        alice.on_refusal(lambda refusal: told.append(refusal.code))
        await alice.control.clear_stop()
        await until(lambda: drive.send_json({"v": 2}) and "safety.release_first" in told)
        assert (wheels.log[0], set(wheels.log[1:])) == (1, {"safety.stop"}), "nothing moves by itself"


async def test_the_lease_of_an_operator_who_leaves_ends_at_once_and_its_wheels_stand() -> None:
    async with driven() as (link, wheels):
        bob = await link.another_operator("Bob")
        drive = link.connection.sendable("drive")
        await until(lambda: drive.send_json({"v": 1}) and wheels.log)

        await link.connection.close()
        await until(lambda: bob.control.leases["motion"].holder is None)
        times = wheels.log.count(1)
        assert times
        assert wheels.log[:times] == [1] * times
        assert set(wheels.log[times:]) <= {"safety.peer_left", "safety.lease_lost"}
        assert len(wheels.log) > 1
        await bob.control.take()
