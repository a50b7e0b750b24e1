"""A tap of data: a listener on the robot itself, that wakes a handler, holds nothing up and says what it lost."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest

from mosaic_core.contract.data_tap import TappedChannel, TappedMessage
from mosaic_core.contract.host import Outgoing, Sender
from mosaic_core.laboratory.joining import until
from mosaic_core.machines.commands.gates import Gate, GateRefusal
from mosaic_core.machines.delivery.delivery_terms import terms_of
from mosaic_core.machines.delivery.framing import PayloadKind
from mosaic_core.machines.delivery.send_scheduler import Offered
from mosaic_core.runtime.commands.inbox import Incoming
from mosaic_core.runtime.delivery import data_tap
from mosaic_core.runtime.delivery.data_tap import RuntimeDataTap
from mosaic_core.runtime.delivery.outbox import Outbox
from mosaic_core.runtime.observation.counters import ConnectorCounters
from mosaic_core.words.data_type import Delivery, MosaicDataType
from mosaic_core.words.delivery import DeliveryContract

CHANNELS = [
    TappedChannel("pose", "pose", MosaicDataType.JSON_R2U),
    TappedChannel("drive", "drive", MosaicDataType.JSON_U2R),
]
ANN = Sender("p1", "s1", "ann", "Ann")


class Bench:
    """An outbox with the channels ``pose``, which sends, and ``drive``, which receives."""

    def __init__(self, delivery: Delivery | DeliveryContract = Delivery.RELIABLE) -> None:
        self.heard: list[tuple[str, bool]] = []
        self.outbox = Outbox(asyncio.get_running_loop(), lambda label, on: self.heard.append((label, on)))
        self.taps = self.outbox.taps
        self.taps.channels = {channel.label: channel for channel in CHANNELS}
        for channel in CHANNELS:
            self.outbox.add_channel(channel.label, terms_of(delivery), ConnectorCounters())

    def tap(self, *labels: str) -> RuntimeDataTap:
        return RuntimeDataTap(asyncio.get_running_loop(), self.outbox, labels)

    def post(self, payload: bytes, stamp_us: int = 5_000_000, **more: Any) -> bool:
        return self.outbox.post(Outgoing("pose", PayloadKind.JSON, payload, stamp_us, **more))


class Listener:
    def __init__(self, answer: Offered) -> None:
        self.answer = answer

    def deliver(self, message: Outgoing) -> Offered:
        return self.answer

    def waiting(self, channel: str) -> tuple[int, int]:
        return 0, 0


async def came(tap: RuntimeDataTap) -> TappedMessage:
    got = await asyncio.to_thread(tap.next, 20.0)
    assert got is not None
    return got


async def test_a_handler_that_runs_while_it_is_watched_runs_for_the_tap_alone() -> None:
    bench = Bench()
    with bench.tap("pose"):
        await until(lambda: bench.heard == [("pose", True)])
        assert bench.outbox.is_heard("pose")
        assert bench.outbox.listeners("pose") == 0
        bench.outbox.join("pose", "p1", Listener(Offered.QUEUED))
    await until(lambda: not bench.taps.is_open("pose"))
    bench.outbox.leave("pose", "p1")
    assert bench.heard == [("pose", True), ("pose", False)]


async def test_two_taps_of_one_channel_are_one_listener() -> None:
    bench = Bench()
    with bench.tap("pose") as first:
        await until(lambda: bench.taps.is_open("pose"))
        with bench.tap("pose", "drive") as second:
            await until(lambda: bench.taps.is_open("drive"))
            bench.post(b"1")
            assert (await came(first)).payload == (await came(second)).payload == b"1"
        await until(lambda: not bench.taps.is_open("drive"))
        assert bench.outbox.is_heard("pose")
    await until(lambda: not bench.outbox.is_heard("pose"))
    assert [one for one in bench.heard if one[0] == "pose"] == [("pose", True), ("pose", False)]


async def test_it_gets_every_byte_with_its_time_and_begins_with_what_a_late_listener_would_get() -> None:
    bench = Bench()
    bench.post(b"0", stamp_us=1_500_000)
    await asyncio.sleep(0)
    with bench.tap("pose") as tap:
        latched = await came(tap)
        bench.post(b"{ }", followers=(b"\x00\xff",))
        bench.post(b"mine", to="p9")
        got = [await came(tap) for _ in range(3)]
    assert (latched.payload, latched.stamped_at_s, latched.sender) == (b"0", 1.5, None)
    assert latched.tapped_at_s > 1.5
    assert [one.payload for one in got] == [b"{ }", b"\x00\xff", b"mine"]


async def test_nobody_sends_faster_because_a_tap_takes_what_a_full_operator_does_not() -> None:
    bench = Bench()
    bench.outbox.join("pose", "p1", Listener(Offered.REFUSED))
    with bench.tap("pose") as tap:
        await until(lambda: bench.taps.is_open("pose"))
        assert bench.post(b"1") is True
        await came(tap)
        assert bench.post(b"2") is False
        assert (await came(tap)).payload == b"2"


async def test_what_is_thinned_for_operators_is_thinned_for_a_tap() -> None:
    bench = Bench(DeliveryContract(mode=Delivery.LATEST, max_rate_hz=0.001))
    with bench.tap("pose") as tap:
        await until(lambda: bench.taps.is_open("pose"))
        for number in range(3):
            bench.post(str(number).encode())
        assert (await came(tap)).payload == b"0"
        assert tap.next(0.0) is None


async def test_a_command_is_told_with_who_sent_it_and_what_became_of_it() -> None:
    bench = Bench()
    item = Incoming("drive", b'{"v": 1}', ANN, 7, 100.0)
    bench.taps.commanded(item, None)  # nobody looks
    with bench.tap("drive") as tap:
        await until(lambda: bench.taps.is_open("drive"))
        bench.taps.commanded(item, None)
        bench.taps.commanded(item, GateRefusal(Gate.STOP, "safety.stopped"))
        done, refused = await came(tap), await came(tap)
    assert (done.payload, done.kind, done.sender, done.code) == (b'{"v": 1}', PayloadKind.JSON, ANN, "")
    assert done.stamped_at_s == 100.0
    assert (refused.code, refused.gate) == ("safety.stopped", "stop")


async def test_a_reader_that_sleeps_loses_the_oldest_and_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(data_tap, "MAX_WAITING_BYTES", 2 * (data_tap.MESSAGE_BYTES + 1))
    bench = Bench()
    with bench.tap("pose") as tap:
        await until(lambda: bench.taps.is_open("pose"))
        for number in range(5):
            bench.post(str(number).encode())
        await until(lambda: tap.dropped == 3)
        assert [(await came(tap)).payload for _ in range(2)] == [b"3", b"4"]


async def test_a_label_that_is_none_is_said_and_nothing_flows() -> None:
    bench = Bench()
    with bench.tap("pose", "posse") as tap:
        await asyncio.sleep(0)
        bench.post(b"1")
        assert tap.next(20.0) is None
        assert tap.failure == "channel.unknown_label"
        assert [channel.label for channel in tap.channels] == ["pose"]
    await asyncio.sleep(0)
    assert bench.heard == []


async def test_after_the_robot_has_stopped_it_says_so() -> None:
    bench = Bench()
    loop = asyncio.new_event_loop()
    loop.close()
    with RuntimeDataTap(loop, bench.outbox, ("pose",)) as tap:
        assert tap.next(20.0) is None
    assert tap.failure == "peer.shutdown"
