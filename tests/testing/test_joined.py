"""A robot and operators in memory: what plugin authors join when a handler alone isn't enough."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Iterator
from typing import Any

import pytest
from pydantic import Field

from mosaic_core import (
    Captured,
    DataChannelBidirectional,
    DataChannelConfigurer,
    DataChannelReceivable,
    DataChannelSendable,
    MediaTrackConfigurer,
    MediaTrackHandler,
    Message,
    NoParams,
    Params,
    Sender,
)
from mosaic_core.runtime.handlers.connection_check import ConnectionCheckConfigurer
from mosaic_core.testing import MemoryFrame, connector, joined, until
from mosaic_core.words.errors import ConfigError


class GaugeParams(Params):
    period_s: float = Field(default=0.02, gt=0)


class Reading(Message):
    number: int


class Gauge(DataChannelSendable[Reading]):
    def __init__(self, label: str, period_s: float) -> None:
        super().__init__(label)
        self.period_s = period_s

    def messages(self) -> Iterator[Reading]:
        for number in self.every(self.period_s):
            yield Reading(number=number)


class GaugeConfigurer(DataChannelConfigurer[GaugeParams]):
    connector_type = "gauge"

    def configure(self) -> Gauge:
        return Gauge(self.label, self.params.period_s)


class Speed(Message):
    mps: float


class Winch(DataChannelReceivable[Speed]):
    timeout_s = 0.2

    def __init__(self, label: str) -> None:
        super().__init__(label)
        self.speeds: list[float] = []
        self.safe: list[str] = []
        self.stopped = threading.Event()

    def handle_data(self, data: Speed, sender: Sender) -> None:
        self.speeds.append(data.mps)

    def make_safe(self, cause: str) -> None:
        self.safe.append(cause)


class WinchConfigurer(DataChannelConfigurer[NoParams]):
    def configure(self) -> Winch:
        return Winch(self.label)


class Echo(DataChannelBidirectional[dict[str, Any]]):
    async def handle_data(self, data: dict[str, Any], sender: Sender) -> None:
        self.send_json({**data, "to": sender.name}, to=sender)


class EchoConfigurer(DataChannelConfigurer[NoParams]):
    def configure(self) -> Echo:
        return Echo(self.label)


class Eye(MediaTrackHandler):
    def frames(self) -> Iterator[Any]:
        for number in self.every(0.02):
            yield Captured(f"picture {number}", 5.0)  # type: ignore[arg-type]


class EyeConfigurer(MediaTrackConfigurer[NoParams]):
    def configure(self) -> Eye:
        return Eye(self.label)


def motor_of(link: Any) -> Winch:
    (motor,) = (one for made in link.configured.connectors for one in made.handlers if isinstance(one, Winch))
    return motor


async def test_messages_arrive_at_every_operator() -> None:
    async with joined(connector(GaugeConfigurer, label="gauge", params={"period_s": 0.01})) as link:
        bob = await link.another_operator()
        for connection in (link.connection, bob):
            first = (await connection.receivable("gauge").next_message()).json()["number"]
            second = (await connection.receivable("gauge").next_message()).json()["number"]
            assert second > first
        assert {sender.name for sender in link.robot.peers} == {"Alice", "Bob"}


async def test_commands_arrive_and_silence_makes_safe() -> None:
    async with joined(connector(WinchConfigurer, label="motor")) as link:
        store = link.connection.sendable("motor")
        await store.wait_open()
        refused: list[Any] = []
        link.connection.on_refusal(refused.append)
        assert store.send_json({"mps": 1.5})
        assert store.send_json({"speed": 1})
        motor = motor_of(link)
        await until(lambda: motor.safe)
        assert (motor.speeds, motor.safe) == ([1.5], ["safety.timeout"])
        await until(lambda: refused)
        assert refused[0].code == "channel.invalid"


async def test_a_cut_cable_makes_safe() -> None:
    async with joined(connector(WinchConfigurer, label="motor", safety={"timeout_s": 30})) as link:
        store = link.connection.sendable("motor")
        await store.wait_open()
        store.send_json({"mps": 1})
        motor = motor_of(link)
        await until(lambda: motor.speeds)
        link.cut()
        await until(lambda: motor.safe)
        assert motor.safe == ["safety.peer_left"]


async def test_answers_reach_only_who_asked() -> None:
    async with joined(connector(EchoConfigurer, label="echo")) as link:
        bob = await link.another_operator("Bob")
        stores = [link.connection.bidirectional("echo"), bob.bidirectional("echo")]
        for store in stores:
            await store.wait_open()
        waiting = asyncio.create_task(stores[1].next_message())
        await asyncio.sleep(0)
        stores[1].send_json({"a": 1})
        assert (await waiting).json() == {"a": 1, "to": "Bob"}
        assert stores[0].latest is None


async def test_pictures_arrive_as_they_were_yielded() -> None:
    async with joined(connector(EyeConfigurer, label="front")) as link:
        frame: Any = await link.connection.media("front").next_frame()
        assert isinstance(frame, MemoryFrame)
        assert frame.image.startswith("picture ")
        assert frame.captured_at_s == 5.0


async def test_built_in_connectors_work_too() -> None:
    async with joined(connector(ConnectionCheckConfigurer, label="link")) as link:
        assert link.connection.catalogue is not None
        assert [entry.label for entry in link.connection.catalogue.entries] == ["link"]


async def test_the_end_leaves_no_thread() -> None:
    before = set(threading.enumerate())
    async with joined(connector(GaugeConfigurer, label="gauge"), connector(WinchConfigurer, label="motor")):
        pass
    left = [thread for thread in set(threading.enumerate()) - before if thread.name.startswith("mosaic")]
    for thread in left:  # it may just be leaving
        thread.join(5.0)
    assert [thread.name for thread in left if thread.is_alive()] == []


async def test_wrong_params_are_told_before_anything_starts() -> None:
    with pytest.raises(ConfigError, match="did you mean 'period_s'"):
        async with joined(connector(GaugeConfigurer, params={"perid_s": 1})):
            pass
