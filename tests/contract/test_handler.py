"""The plugin author's classes: types are found, ticks tick, and a message becomes bytes."""

from __future__ import annotations

import asyncio
import inspect
import sys
from collections import Counter
from collections.abc import AsyncIterator, Callable, Iterator, Mapping
from typing import Any, ClassVar

import pytest
from pydantic import BaseModel, create_model

from mosaic_core import (
    DataChannelBidirectional,
    DataChannelConfigurer,
    DataChannelJsonReceivable,
    DataChannelReceivable,
    DataChannelSendable,
    MediaTrackHandler,
    Message,
    MosaicDataType,
    NoParams,
    Params,
    Shared,
)
from mosaic_core.contract.handler import message_type_of
from mosaic_core.contract.host import Loss, Outgoing, Sender
from mosaic_core.machines.delivery.framing import PayloadKind
from mosaic_core.words.errors import MosaicError
from mosaic_core.words.limits import MotionKind


class Reading(Message):
    volts: float


class ScriptedHost:
    """Time passes when somebody waits; stops after `ticks` waits."""

    def __init__(self, ticks: int = 1000) -> None:
        self.now_s = 100.0
        self.left = ticks
        self.sent: list[Outgoing] = []
        self.losses: Counter[Loss] = Counter()
        self.is_stopping = False

    def monotonic_s(self) -> float:
        return self.now_s

    def wait(self, seconds: float) -> bool:
        self.now_s += seconds
        self.left -= 1
        self.is_stopping = self.left <= 0
        return self.is_stopping

    async def wait_async(self, seconds: float) -> bool:
        return self.wait(seconds)

    def send(self, message: Outgoing) -> bool:
        self.sent.append(message)
        return True

    def count_loss(self, reason: Loss, messages: int) -> None:
        self.losses[reason] += messages

    def offer(self, label: str, item: Any) -> bool:
        return label == "front"


class Gauge(DataChannelSendable[Reading]):
    def messages(self) -> Iterator[Reading]:
        for tick in self.every(0.5):
            yield Reading(volts=tick)


def test_the_data_type_follows_from_the_type_argument() -> None:
    class Text(DataChannelSendable[str]): ...

    class Raw(DataChannelReceivable[bytes]): ...

    class Both(DataChannelBidirectional[Reading]): ...

    class Derived(Gauge): ...

    assert Gauge.data_type is MosaicDataType.JSON_R2U
    assert Text.data_type is MosaicDataType.STRING_R2U
    assert Raw.data_type is MosaicDataType.BYTE_U2R
    assert Both.data_type is MosaicDataType.JSON_BI
    assert DataChannelJsonReceivable.data_type is MosaicDataType.JSON_U2R
    assert MediaTrackHandler.data_type is MosaicDataType.MEDIA
    assert message_type_of(Derived) is Reading
    assert message_type_of(DataChannelJsonReceivable) == dict[str, Any]


class Lift(Message):
    motion_kinds: ClassVar[Mapping[str, MotionKind]] = {"speed": "velocity", "height": "position"}
    speed: float = 0.0
    height: float | None = None


class Points(Message):
    motion_kinds: ClassVar[Mapping[str, MotionKind]] = {"positions": "position"}
    positions: list[float]


class Rates(Message):
    motion_kinds: ClassVar[Mapping[str, MotionKind]] = {"rates": "velocity"}
    rates: list[float]


def test_of_a_list_the_positions_are_position_fields_and_velocities_are_nothing() -> None:
    class Along(DataChannelReceivable[Points]): ...

    class Turning(DataChannelReceivable[Rates]): ...

    assert Along.position_fields == ("positions.*",)
    assert (Turning.motion_fields, Turning.position_fields) == ((), ())


def test_the_velocities_of_a_message_are_the_motion_fields_of_its_receivers() -> None:
    class Lifter(DataChannelReceivable[Lift]): ...

    class Derived(Lifter): ...

    class Told(DataChannelBidirectional[Lift]):
        motion_fields: ClassVar[tuple[str, ...]] = ("height",)

    class Unmoved(DataChannelReceivable[Lift]):
        motion_fields: ClassVar[tuple[str, ...]] = ()

    class DerivedUnmoved(Unmoved): ...

    class Plain(DataChannelReceivable[Reading]): ...

    assert Lifter.motion_fields == Derived.motion_fields == ("speed",)
    assert Lifter.position_fields == Derived.position_fields == ("height",)
    assert (Told.motion_fields, Told.position_fields) == (("height",), ()), "what it says itself counts"
    assert Unmoved.motion_fields == DerivedUnmoved.motion_fields == Plain.motion_fields == ()


def test_every_ticks_on_a_grid_and_ends_at_stop() -> None:
    gauge, host = Gauge("g"), ScriptedHost(ticks=3)
    gauge.bind(host)
    assert [reading.volts for reading in gauge.messages()] == [0.0, 1.0, 2.0]
    assert host.now_s == pytest.approx(101.5)


def test_a_late_body_skips_ticks_instead_of_catching_up() -> None:
    gauge, host = Gauge("g"), ScriptedHost(ticks=3)
    gauge.bind(host)
    ticks = []
    for tick in gauge.every(1.0):
        ticks.append((tick, host.now_s - 100.0))
        host.now_s += 2.5 if tick == 0 else 0.0
    assert ticks == [(0, 0.0), (2, 2.5), (3, 3.0)]


def test_every_works_in_async_bodies() -> None:
    gauge = Gauge("g")
    gauge.bind(ScriptedHost(ticks=3))

    async def collect() -> list[int]:
        return [tick async for tick in gauge.every(0.1)]

    assert asyncio.run(collect()) == [0, 1, 2]


async def test_a_plain_for_over_every_in_an_async_def_is_refused_with_line_and_cure() -> None:
    gauge = Gauge("g")
    gauge.bind(ScriptedHost(ticks=3))

    async def messages() -> AsyncIterator[int]:
        for tick in gauge.every(0.1):
            yield tick

    with pytest.raises(MosaicError) as refused:
        await anext(messages())
    assert refused.value.code == "plugin.blocks_loop"
    line = inspect.getsourcelines(messages)[1] + 1
    assert f"test_handler.py:{line} in " in str(refused.value)
    assert f"Write `async for` in line {line}, or make messages a `def`" in refused.value.cure


def test_a_period_must_be_positive() -> None:
    with pytest.raises(ValueError, match=r"every\(0\): a period is more than 0 seconds; without any rest write `while"):
        Gauge("g").every(0)


def test_what_is_sent_says_what_it_is() -> None:
    class Loose(DataChannelBidirectional[Reading]): ...

    gauge, host = Loose("g"), ScriptedHost()
    gauge.bind(host)
    peer = Sender(peer_id="p", session_id="s")
    assert gauge.send(Reading(volts=1.5), to=peer)
    assert gauge.send("text")
    assert gauge.send(bytearray(b"raw"))
    assert [(message.kind, message.payload, message.to) for message in host.sent] == [
        (PayloadKind.JSON, b'{"volts":1.5}', "p"),
        (PayloadKind.STRING, b"text", None),
        (PayloadKind.BYTES, b"raw", None),
    ]
    assert {message.stamp_us for message in host.sent} == {100_000_000}


def test_an_unbound_handler_sends_nothing_and_says_so() -> None:
    assert not Gauge("g").send_json({"volts": 1})


def test_nan_never_leaves_the_robot() -> None:
    gauge, host = Gauge("g"), ScriptedHost()
    gauge.bind(host)
    assert not gauge.send_json({"volts": float("nan")})
    assert not host.sent
    assert host.losses == {"refused": 1}


def test_a_message_refuses_nan_and_ignores_unknown_keys() -> None:
    assert Reading.model_validate({"volts": 1, "more": 2}).volts == 1
    for bad in (float("nan"), float("inf"), "x"):
        with pytest.raises(ValueError, match="volts"):
            Reading.model_validate({"volts": bad})


class GaugeParams(Params):
    period_s: float = 1.0


@pytest.mark.parametrize(
    "wrapped", [lambda it: it, lambda it: it | None, lambda it: list[it], lambda it: dict[str, it]]
)
def test_params_nest_no_model_that_ignores_keys(wrapped: Callable[[Any], Any]) -> None:
    class Port(BaseModel):
        number: int = 1

    class Strict(BaseModel, extra="forbid"):
        number: int = 1

    for good in (GaugeParams, Strict, int):
        assert create_model("Good", __base__=Params, port=(wrapped(good), ...))
    with pytest.raises(MosaicError) as refused:
        create_model("Bad", __base__=Params, __module__=__name__, port=(wrapped(Port), ...))
    words = "Bad: its field 'port' is a Port, which ignores a misspelt key. Derive Port from Params."
    assert str(refused.value).startswith(f"{__file__}:")
    assert str(refused.value).endswith(words)


class GaugeConfigurer(DataChannelConfigurer[GaugeParams]):
    connector_type = "gauge"

    def configure(self) -> Gauge:
        return Gauge(self.label)


def test_the_params_model_is_the_type_argument() -> None:
    class Derived(GaugeConfigurer): ...

    class Bare(DataChannelConfigurer[NoParams]):
        def configure(self) -> Gauge:
            return Gauge(self.label)

    assert GaugeConfigurer.params_model is GaugeParams
    assert Derived.params_model is GaugeParams
    assert Bare.params_model is NoParams


def test_params_refuse_unknown_keys_and_read_numbers_from_strings() -> None:
    assert GaugeParams.model_validate({"period_s": "0.5"}).period_s == 0.5
    with pytest.raises(ValueError, match="perod_s"):
        GaugeParams.model_validate({"perod_s": 1})


class Bus:
    def __init__(self, log: list[str], name: str) -> None:
        self.log, self.name = log, name

    def __enter__(self) -> Bus:
        self.log.append(f"+{self.name}")
        return self

    def __exit__(self, *args: object) -> None:
        self.log.append(f"-{self.name}")


def test_shared_things_are_made_once_and_closed_in_reverse_order() -> None:
    log: list[str] = []
    shared = Shared()
    first = shared.get("a", lambda: Bus(log, "a"))
    assert shared.get("a", lambda: Bus(log, "other")) is first
    shared.get("b", lambda: Bus(log, "b"))
    with shared.entered():
        assert log == ["+a", "+b"]
    assert log == ["+a", "+b", "-b", "-a"]


class PortParams(Params):
    port: str
    baud: int = 9600


class Line(Bus):
    def __init__(self, params: PortParams) -> None:
        super().__init__([], params.port)
        self.params = params


def test_connectors_that_describe_a_shared_thing_differently_are_told_by_what() -> None:
    shared = Shared()

    def line(baud: int, port: str = "a") -> Line:
        params = PortParams(port=port, baud=baud)
        return shared.of("one").agreed(f"acme:{port}", lambda: Line(params), params, f"the line {port}")

    assert line(9600) is line(9600)
    assert line(115_200, "b") is not line(9600)
    with pytest.raises(MosaicError, match="the line a differently: baud") as told:
        line(19_200)
    assert told.value.code == "config.invalid"


async def test_ticks_that_are_left_early_leave_nothing_to_close() -> None:
    gauge, begun = Gauge("g"), list[Any]()
    gauge.bind(ScriptedHost())
    usual = sys.get_asyncgen_hooks()
    sys.set_asyncgen_hooks(firstiter=begun.append)
    try:
        async for _ in gauge.every(0.1):
            break
    finally:
        sys.set_asyncgen_hooks(*usual)
    assert not begun, "a loop that ends has no time for a generator that nobody closes"
