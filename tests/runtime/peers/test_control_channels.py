"""The two channels for words: pings are answered, refusals told at a pace, and what can't be read does no harm."""

from __future__ import annotations

from typing import Any

import pytest

from mosaic_core.machines.commands.command_order import ArrivalBaseline
from mosaic_core.machines.delivery.framing import Frame, FrameReader, PayloadKind, encode_frame
from mosaic_core.machines.delivery.send_scheduler import Offered, Priority, QueuedMessage
from mosaic_core.runtime.peers import control_channel, stop_channel
from mosaic_core.runtime.peers.control_channel import MAX_CONTROL_BYTES, ControlChannel
from mosaic_core.runtime.peers.stop_channel import MAX_STOP_BYTES, StopChannel
from mosaic_core.testing import until
from mosaic_core.words.control import (
    CHANNEL_PROTOCOL,
    CONTROL_EXTENSIONS,
    ControlMessage,
    DeliveryWatch,
    Hello,
    Ping,
    Pong,
    Refusal,
    Stop,
    StopAck,
    parse_control,
)
from mosaic_core.words.errors import ConnectionFailed


class Wire:
    """The other end of one data channel; ``told``: what it read there."""

    label, protocol, is_reliable = "_mosaic", CHANNEL_PROTOCOL, True

    def __init__(self) -> None:
        self.is_open = True
        self.buffered_bytes = 0
        self.on_open: Any = None
        self.on_message: Any = None
        self._reader = FrameReader(MAX_CONTROL_BYTES)
        self.frames: list[Frame] = []

    def send(self, data: bytes) -> None:
        if not self.is_open:
            raise ConnectionFailed("The channel is not open.", code="channel.timeout")
        frame = self._reader.read(data, 0.0)
        assert frame is not None
        self.frames.append(frame)

    @property
    def told(self) -> list[ControlMessage | None]:
        return [parse_control(frame.payload.decode()) for frame in self.frames]

    def says(self, message: ControlMessage, seq: int = 1) -> None:
        frame = Frame(PayloadKind.JSON, message.to_text().encode(), seq=seq)
        for piece in encode_frame(frame):
            self.on_message(piece)


class Queue:
    """Sends at once. ``priorities``: what was opened how."""

    def __init__(self) -> None:
        self.priorities: list[Priority] = []

    def open(self, channel: Wire, priority: Priority) -> None:
        self._channel = channel
        self.priorities.append(priority)

    def offer(self, message: QueuedMessage) -> Offered:
        for piece in message.pieces:
            self._channel.send(piece)  # type: ignore[arg-type]
        return Offered.QUEUED


class Clock:
    now_s = 1000.0

    def monotonic(self) -> float:
        return self.now_s


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    it = Clock()
    monkeypatch.setattr(control_channel, "time", it)
    monkeypatch.setattr(stop_channel, "time", it)
    return it


class Desk:
    """A control channel; ``heard``: what it handed on."""

    def __init__(self) -> None:
        self.wire, self.queue = Wire(), Queue()
        self.heard: list[ControlMessage | None] = []
        wire: Any = self.wire
        queue: Any = self.queue
        self.channel = ControlChannel(wire, queue, ArrivalBaseline(), self.heard.append)


def test_hello_is_said_as_soon_as_the_channel_is_open(clock: Clock) -> None:
    hello = Hello(extensions=CONTROL_EXTENSIONS, software="robot 1", boot_id="boot")
    desk = Desk()
    desk.channel.greet("robot 1", "boot")
    assert desk.wire.told == [hello]
    assert desk.queue.priorities == [Priority.CONTROL]
    late = Desk()
    late.wire.is_open = False
    late.channel.greet("robot 1", "boot")
    late.wire.is_open = True
    late.wire.on_open()
    assert late.wire.told == [hello]


def test_a_ping_is_answered_with_both_times_and_counts_as_a_sign_of_life(clock: Clock) -> None:
    desk = Desk()
    desk.wire.says(Ping(t0=7))
    assert desk.wire.told == [Pong(t0=7, t1=1_000_000_000, t2=1_000_000_000)]
    assert desk.heard == [None]
    assert desk.wire.frames[0].stamp_us == 1_000_000_000


def test_pings_without_end_are_answered_at_a_bounded_rate(clock: Clock) -> None:
    desk = Desk()
    for number in range(10_000):
        clock.now_s += 0.0001
        desk.wire.says(Ping(t0=number), seq=number + 1)
    assert 1 <= len(desk.wire.frames) <= control_channel.MAX_PINGS_HZ * 1.5
    assert desk.heard == [None] * 10_000, "it is alive all the same"


def test_every_other_word_is_handed_on(clock: Clock) -> None:
    desk = Desk()
    desk.wire.says(DeliveryWatch(on=True))
    assert desk.heard == [DeliveryWatch(on=True)]
    assert desk.wire.told == []


async def test_ten_requests_that_are_refused_are_told_ten_times() -> None:
    desk = Desk()
    for seq in range(10):
        desk.channel.refuse("arm", seq, "lease.required", gate="lease")
    assert desk.wire.told == [Refusal(label="arm", seq=seq, code="lease.required", gate="lease") for seq in range(10)]


async def test_a_flood_of_refusals_is_counted_in_the_next_that_is_told() -> None:
    desk = Desk()
    for seq in range(100):
        desk.channel.refuse("arm", seq, "safety.too_fast")
    assert len(desk.wire.told) == 10
    await until(lambda: len(desk.wire.told) > 10)
    assert desk.wire.told[10:] == [Refusal(label="arm", seq=99, code="safety.too_fast", count=90)]


@pytest.mark.parametrize(
    ("data", "code"),
    [
        (b"x" * (MAX_CONTROL_BYTES + 1), "channel.too_large"),
        ("text", None),
        (next(iter(encode_frame(Frame(PayloadKind.JSON, b"\xff", seq=1)))), "signal.bad_message"),
    ],
)
def test_what_cant_be_read_is_refused_and_the_next_word_is_heard(
    clock: Clock, data: bytes | str, code: str | None
) -> None:
    desk = Desk()
    desk.wire.on_message(data)
    [refusal] = desk.wire.told
    assert isinstance(refusal, Refusal)
    assert (refusal.label, refusal.seq) == ("_mosaic", None)
    assert refusal.message
    assert code in (refusal.code, None)
    desk.wire.says(DeliveryWatch(on=False))
    assert desk.heard == [DeliveryWatch(on=False)]


# -- the stop channel


class StopScene:
    """A stop channel; ``heard``: the stops and pongs."""

    def __init__(self) -> None:
        self.wire = Wire()
        self.heard: list[ControlMessage] = []
        wire: Any = self.wire
        self.channel = StopChannel(wire, self._heard)

    def _heard(self, message: Stop | Pong, answer: Any) -> None:
        self.heard.append(message)
        if isinstance(message, Stop):
            answer(StopAck(id=message.id, received_us=5))


def test_a_stop_is_answered_where_it_was_heard(clock: Clock) -> None:
    scene = StopScene()
    scene.wire.says(Stop(id="a"))
    scene.wire.says(Pong(t0=1, t1=2, t2=3), seq=2)
    assert scene.heard == [Stop(id="a"), Pong(t0=1, t1=2, t2=3)]
    assert scene.wire.told == [StopAck(id="a", received_us=5)]
    [frame] = scene.wire.frames
    assert (frame.kind, frame.seq, frame.stamp_us) == (PayloadKind.JSON, 1, 1_000_000_000)


def test_what_the_robot_says_there_is_numbered(clock: Clock) -> None:
    scene = StopScene()
    for _ in range(3):
        scene.channel.send(Ping(t0=1))
    assert [frame.seq for frame in scene.wire.frames] == [1, 2, 3]


def test_nothing_but_stops_and_pongs_is_heard_there(clock: Clock) -> None:
    scene = StopScene()
    scene.wire.says(DeliveryWatch(on=True))
    scene.wire.on_message("stop")
    scene.wire.on_message(b"\xff" * 30)
    assert scene.heard == []
    scene.wire.says(Stop(id="a"))
    assert scene.heard == [Stop(id="a")], "and none of it did harm"


def test_a_stop_repeated_without_end_fills_no_queue_of_one_who_takes_no_answer(clock: Clock) -> None:
    scene = StopScene()
    scene.wire.buffered_bytes = stop_channel.MAX_UNSENT_BYTES + 1
    scene.wire.says(Stop(id="a"))
    assert (len(scene.heard), scene.wire.told) == (1, [])
    scene.wire.buffered_bytes = 0
    scene.wire.says(Stop(id="a"), seq=2)
    assert scene.wire.told == [StopAck(id="a", received_us=5)]


def test_a_closed_stop_channel_swallows_what_is_said(clock: Clock) -> None:
    scene = StopScene()
    scene.wire.is_open = False
    assert not scene.channel.is_open
    scene.channel.send(Ping(t0=1))
    scene.wire.is_open = True
    assert scene.channel.is_open


@pytest.mark.parametrize(("more_bytes", "is_heard"), [(0, True), (1, False)])
def test_a_stop_is_small(clock: Clock, more_bytes: int, is_heard: bool) -> None:
    scene, word = StopScene(), Stop(id="a").to_text().encode()
    [small] = encode_frame(Frame(PayloadKind.JSON, word, seq=1))
    padding = b" " * (MAX_STOP_BYTES - len(small) + more_bytes)
    [piece] = encode_frame(Frame(PayloadKind.JSON, word + padding, seq=1))
    assert len(piece) == MAX_STOP_BYTES + more_bytes
    scene.wire.on_message(piece)
    assert len(scene.heard) == is_heard
