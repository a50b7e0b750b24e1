"""A robot and operators in memory: what plugin authors join when a handler alone isn't enough."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Iterator
from typing import Any

import av
import numpy as np
import pytest
from pydantic import Field

from mosaic_core import (
    Captured,
    Configurer,
    DataChannelBidirectional,
    DataChannelConfigurer,
    DataChannelReceivable,
    DataChannelSendable,
    Handler,
    MediaTrackConfigurer,
    MediaTrackHandler,
    Message,
    NoParams,
    Params,
    Sender,
)
from mosaic_core.runtime.handlers.connection_check import ConnectionCheckConfigurer
from mosaic_core.testing import MemoryFrame, MemoryNetwork, connector, joined, until
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
            yield Captured(np.full((4, 6), number % 200, np.uint8), 5.0)


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
        assert frame.image.shape == (4, 6)
        assert frame.captured_at_s == 5.0


class Film(MediaTrackHandler):
    """A colour, then a gray one, then the same as PyAV has it."""

    def frames(self) -> Iterator[Any]:
        colour = np.full((6, 8, 3), (10, 20, 30), np.uint8)
        pictures = [colour, np.full((6, 8), 90, np.uint8), av.VideoFrame.from_ndarray(colour, format="bgr24")]
        for number in self.every(0.02):
            yield pictures[number % 3]


class FilmConfigurer(MediaTrackConfigurer[NoParams]):
    def configure(self) -> Film:
        return Film(self.label)


@pytest.mark.parametrize("profile", ["pristine", "4g"])
async def test_a_test_takes_pictures_in_memory_as_a_real_operator_does(profile: str) -> None:
    async with joined(connector(FilmConfigurer, label="front"), network=MemoryNetwork(profile)) as link:
        front = link.connection.media("front")
        colours = set()
        while len(colours) < 2:  # who is slow is shown the newest, which may be the same again
            image = await front.next_image()
            assert (image.shape, image.dtype.name) == ((6, 8, 3), "uint8")
            colours.add(tuple(map(int, image[0, 0])))
        assert colours == {(10, 20, 30), (90, 90, 90)}


def test_a_picture_in_memory_answers_as_one_of_pyav_and_is_a_copy() -> None:
    pixels = np.zeros((6, 8, 3), np.uint8)
    frame = MemoryFrame(pixels, 0.0)
    assert (frame.width, frame.height, frame.to_ndarray(format="gray").shape) == (8, 6, (6, 8))
    frame.to_ndarray()[:] = 1
    assert not pixels.any()


@pytest.mark.parametrize(
    ("image", "message"),
    [
        ("text", "uint8 .* not str"),
        (np.zeros((6, 8, 3)), "uint8 .* not ndarray float64"),
        (av.Packet(b"x"), "encoded already is decoded by a real operator only"),
    ],
)
def test_what_is_no_picture_can_not_be_taken_and_says_why(image: Any, message: str) -> None:
    with pytest.raises(TypeError, match=message):
        MemoryFrame(image, 0.0).to_ndarray()


async def test_an_operator_holds_no_lease_unless_told() -> None:
    motor = connector(WinchConfigurer, label="motor", safety={"requires_lease": True})
    async with joined(motor) as link:
        refused: list[Any] = []
        link.connection.on_refusal(refused.append)
        pad = link.connection.sendable("motor")
        await pad.wait_open()
        pad.send_json({"mps": 1})
        await until(lambda: refused)
        assert refused[0].code == "lease.required"
    async with joined(motor, takes_leases=True) as link:
        pad = link.connection.sendable("motor")
        await pad.wait_open()
        await until(lambda: pad.send_json({"mps": 1}) and motor_of(link).speeds)


class PairConfigurer(Configurer[NoParams]):
    def configure(self) -> list[Handler]:
        return [Gauge(f"{self.label}_gauge", 0.02), Winch(f"{self.label}_winch")]


async def test_each_handler_of_one_connector_has_its_store() -> None:
    async with joined(connector(PairConfigurer, label="cell")) as link:
        assert "number" in (await link.connection.receivable("cell_gauge").next_message()).json()
        pad = link.connection.sendable("cell_winch")
        await pad.wait_open()
        await until(lambda: pad.send_json({"mps": 1}) and motor_of(link).speeds)


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
