"""The quicker SCTP: nothing is lost, doubled or mixed up, whoever is at the other end and however bad the path."""

from __future__ import annotations

import asyncio
import gc
import hashlib
import inspect
import random
import time
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Any

import pytest
from aiortc import RTCDataChannel, RTCDataChannelParameters
from aiortc.rtcsctptransport import InboundStream, RTCSctpCapabilities, RTCSctpTransport
from hypothesis import given, settings
from hypothesis import strategies as st
from OpenSSL import SSL

from mosaic_core.adapters.aiortc_private.sctp import sctp_retransmitting, sctp_sending
from mosaic_core.adapters.aiortc_private.sctp.quick_sctp import QuickSctp, quicken
from mosaic_core.adapters.aiortc_private.sctp.sctp import MeasuredQueue, SctpQueue
from mosaic_core.laboratory.joining import until
from mosaic_core.machines.congestion.ack_pace import AckPace

WAIT_S = 20.0


class Wire:
    """One end of a path in memory, in place of DTLS; ``fate`` says how often a packet arrives."""

    def __init__(self, role: str, fate: Callable[[], int]) -> None:
        self.state = "connected"
        self._role = role
        self.other: Wire | None = None
        self.fate = fate
        self.sent = 0
        self.receiver: Any = None
        self._inbox: asyncio.Queue[bytes] = asyncio.Queue()
        self._task = asyncio.get_running_loop().create_task(self._deliver())

    def _register_data_receiver(self, receiver: Any) -> None:
        self.receiver = receiver

    def _unregister_data_receiver(self, receiver: Any) -> None:
        self.receiver = None

    async def _send_data(self, data: bytes) -> None:
        self.sent += 1
        assert self.other is not None
        for _ in range(self.fate()):
            self.other._inbox.put_nowait(data)

    async def _deliver(self) -> None:
        while True:
            data = await self._inbox.get()
            if self.receiver is not None:
                await self.receiver._handle_data(data)

    async def stop(self) -> None:
        self._task.cancel()
        await asyncio.gather(self._task, return_exceptions=True)


class Association:
    def __init__(self, wires: tuple[Wire, Wire], ends: tuple[RTCSctpTransport, RTCSctpTransport]) -> None:
        self.wires = wires
        self.ends = ends
        self.came: asyncio.Queue[bytes | str] = asyncio.Queue()
        ends[1].on("datachannel", self._channel_came)

    def _channel_came(self, channel: RTCDataChannel) -> None:
        channel.on("message", self.came.put_nowait)

    async def channel(self, **options: Any) -> RTCDataChannel:
        channel = RTCDataChannel(self.ends[0], RTCDataChannelParameters(label="x", **options))
        await until(lambda: channel.readyState == "open")
        return channel

    async def next(self) -> bytes | str:
        return await asyncio.wait_for(self.came.get(), WAIT_S)


def always() -> int:
    return 1


@asynccontextmanager
async def associated(
    *, fate: Callable[[], int] = always, quick: tuple[bool, bool] = (True, True)
) -> AsyncIterator[Any]:
    wires = (Wire("client", always), Wire("server", always))
    wires[0].other, wires[1].other = wires[1], wires[0]
    ends = tuple(RTCSctpTransport(wire) for wire in wires)  # type: ignore[arg-type] # in place of DTLS
    for end, is_quick in zip(ends, quick, strict=True):
        if is_quick:
            quicken(end)
    association = Association(wires, (ends[0], ends[1]))
    for end in ends:
        await end.start(RTCSctpCapabilities(maxMessageSize=262144), 5000)
    try:
        opener = await association.channel()
        opener.send("established")
        assert await association.next() == "established"
        wires[0].fate = wires[1].fate = fate
        yield association
    finally:
        for wire in wires:
            wire.fate = always
        for end in ends:
            await end.stop()
        for wire in wires:
            await wire.stop()


BOTH_WAYS = pytest.mark.parametrize("quick", [(True, True), (True, False), (False, True)], ids=str)


@BOTH_WAYS
async def test_messages_of_all_sizes_arrive_in_order_and_whole(quick: tuple[bool, bool]) -> None:
    sizes = [1, 1000, 1160, 1161, 16_384, 200_000, 3, 65_536] * 3

    async with associated(quick=quick) as link:
        channel = await link.channel()
        for number, size in enumerate(sizes):
            channel.send(bytes([number]) * size)
        for number, size in enumerate(sizes):
            assert await link.next() == bytes([number]) * size


@pytest.mark.parametrize("seed", range(4))
@BOTH_WAYS
async def test_loss_and_doubling_cost_time_but_no_message(quick: tuple[bool, bool], seed: int) -> None:
    chance = random.Random(seed)

    async with associated(fate=lambda: chance.choices((0, 1, 2), (3, 95, 2))[0], quick=quick) as link:
        channel = await link.channel()
        for number in range(60):
            channel.send(b"%d" % number + b"." * chance.randrange(4000))
        received = [(await link.next()).split(b".")[0] for _ in range(60)]  # type: ignore[arg-type] # bytes were sent
        assert received == [b"%d" % number for number in range(60)]
        assert link.came.empty()


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 2**32), loss=st.floats(0, 0.3))
async def test_what_is_never_retransmitted_is_lost_or_right(seed: int, loss: float) -> None:
    chance = random.Random(seed)

    async with associated(fate=lambda: int(chance.random() >= loss)) as link:
        channel = await link.channel(ordered=False, maxRetransmits=0)
        for number in range(80):
            channel.send(b"%d" % number * 30)
            await asyncio.sleep(0)
        link.wires[0].fate = link.wires[1].fate = always
        reliable = await link.channel()
        reliable.send(b"end")
        received = []
        while (message := await link.next()) != b"end":
            received.append(message)
        sent = [b"%d" % number * 30 for number in range(80)]
        assert set(received) <= set(sent)
        assert len(received) == len(set(received))


@pytest.mark.parametrize("loss", [0.0, 0.1])
async def test_what_gives_way_arrives_all_the_same(loss: float) -> None:
    chance = random.Random(5)

    async with associated(fate=lambda: int(chance.random() >= loss)) as link:
        link.ends[0].gives_way = True  # type: ignore[attr-defined] # quicken() made it one that knows
        channel = await link.channel()
        for number in range(40):
            channel.send(b"%d" % number + b"." * 8000)
        received = [(await link.next()).split(b".")[0] for _ in range(40)]  # type: ignore[arg-type] # bytes were sent
        assert received == [b"%d" % number for number in range(40)]


async def test_what_gives_way_leaves_the_event_loop_its_time() -> None:
    packet_s, messages = 0.002, 100

    async with associated() as link:
        link.ends[0].gives_way = True  # type: ignore[attr-defined] # quicken() made it one that knows
        channel = await link.channel()
        send = link.wires[0]._send_data

        async def send_slowly(data: bytes) -> None:
            end_s = time.monotonic() + packet_s
            while time.monotonic() < end_s:
                pass
            await send(data)

        link.wires[0]._send_data = send_slowly  # type: ignore[method-assign]
        began_s = time.monotonic()
        for _ in range(messages):
            channel.send(b"." * 1100)
        for _ in range(messages):
            await link.next()
        last_burst_s = sctp_sending.BURST_BYTES / 1100 * packet_s
        assert time.monotonic() - began_s > messages * packet_s / sctp_sending.BACKGROUND_SHARE - 3 * last_burst_s


@pytest.mark.parametrize(
    ("round_trip_s", "flight_packets", "waiting_packets", "waits"),
    [
        (0.001, 45, 100, True),
        (0.001, 20, 100, False),
        (0.001, 45, 3, False),
        (0.1, 45, 100, False),
        (None, 45, 100, False),
    ],
    ids=["fast and full", "little on its way", "all that waits has room", "slow", "unknown round trip"],
)
async def test_only_a_fast_flow_waits_until_a_batch_is_worth_a_turn(
    round_trip_s: float | None, flight_packets: int, waiting_packets: int, waits: bool
) -> None:
    async with associated() as link:
        sctp = link.ends[0]
        assert isinstance(sctp, QuickSctp)
        size = sctp_sending.USERDATA_MAX_LENGTH
        sctp._srtt, sctp._cwnd, sctp._flight_size = round_trip_s, 48 * size, flight_packets * size
        sctp._outbound_queue = MeasuredQueue(lambda _: size)  # type: ignore[assignment] # any entries
        for number in range(waiting_packets):
            sctp._outbound_queue.append(number)  # type: ignore[arg-type]
        try:
            assert sctp._waits_for_more_room() is waits
            sctp._fast_recovery_exit = 1
            assert not sctp._waits_for_more_room()
        finally:
            sctp._outbound_queue.clear()
            sctp._fast_recovery_exit, sctp._flight_size = None, 0


async def test_half_of_the_packets_are_acknowledged_and_the_last_one_within_the_delay() -> None:
    async with associated() as link:
        channel = await link.channel()
        before = [wire.sent for wire in link.wires]
        channel.send(b"x" * 1160 * 200)
        await link.next()
        await until(lambda: not link.ends[0]._sent_queue)
        data, acknowledgements = (wire.sent - sent for wire, sent in zip(link.wires, before, strict=True))
        assert data >= 200
        assert acknowledgements <= data * 0.6


async def test_a_path_that_was_dead_for_a_while_is_used_again_without_losing_anything() -> None:
    async with associated() as link:
        channel = await link.channel()
        link.wires[0].fate, before = lambda: 0, link.wires[0].sent
        for number in range(20):
            channel.send(b"%d" % number)
        await until(lambda: link.wires[0].sent > before)
        with pytest.raises(TimeoutError):
            await asyncio.wait_for(link.came.get(), 0.1)
        link.wires[0].fate = always
        assert [await link.next() for _ in range(20)] == [b"%d" % number for number in range(20)]


async def test_a_transport_is_quickened_once_and_only_when_it_is_aiortcs_own() -> None:
    class Other(RTCSctpTransport):
        pass

    wire = Wire("client", always)
    sctp, other = RTCSctpTransport(wire), Other(wire)  # type: ignore[arg-type] # in place of DTLS
    quicken(sctp)
    window = sctp._cwnd
    sctp._cwnd += 1
    quicken(sctp)
    quicken(other)
    assert (type(sctp), sctp._cwnd, type(other)) == (QuickSctp, window + 1, Other)
    await wire.stop()


@BOTH_WAYS
async def test_small_messages_sent_together_share_packets(quick: tuple[bool, bool]) -> None:
    async with associated(quick=quick) as link:
        channel = await link.channel()
        await until(lambda: not link.ends[0]._sent_queue)
        before = link.wires[0].sent
        for number in range(100):
            channel.send(b"%03d" % number + b"." * 97)
        assert [await link.next() for _ in range(100)] == [b"%03d" % number + b"." * 97 for number in range(100)]
        packets = link.wires[0].sent - before
        assert packets <= 25 if quick[0] else packets >= 100


async def test_empty_messages_and_text_stay_what_they_are() -> None:
    messages: list[bytes | str] = [b"", "", "grüße", b"\0", "x", b"", ""]

    async with associated() as link:
        channel = await link.channel()
        for message in messages:
            channel.send(message)
        assert [await link.next() for _ in messages] == messages


async def test_a_message_that_the_other_side_does_not_take_is_refused_with_both_sizes() -> None:
    async with associated() as link:
        channel = await link.channel()
        with pytest.raises(ValueError, match="262145 bytes are too many: the other side takes messages of 262144"):
            channel.send(bytes(262_145))
        assert channel.bufferedAmount == 0


async def test_a_clock_that_is_set_does_not_change_how_long_a_lost_packet_is_waited_for(monkeypatch: Any) -> None:
    async with associated() as link:
        channel = await link.channel()
        real = time.time
        for hours in (1, -1, 1000):
            monkeypatch.setattr(time, "time", lambda hours=hours: real() + hours * 3600)
            channel.send(b"x" * 5000)
            await link.next()
            await until(lambda: not link.ends[0]._sent_queue)
        assert link.ends[0]._rto == sctp_retransmitting.LEAST_RTO_S
        assert 0 < (link.ends[0]._srtt or 0) < WAIT_S


def test_packets_of_a_dense_flow_are_acknowledged_many_at_a_time_and_the_rest_soon_after() -> None:
    async def acknowledged(packets: int, *, is_dense: bool) -> int:
        wire = Wire("server", always)
        wire.other = Wire("client", always)
        sctp = RTCSctpTransport(wire)  # type: ignore[arg-type] # in place of DTLS
        quicken(sctp)
        assert isinstance(sctp, QuickSctp)
        sctp._last_received_tsn, sctp._remote_port = 0, 5000
        sctp._set_state(sctp.State.ESTABLISHED)
        sctp._ack_pace = AckPace()
        sctp._ack_pace.packets = 8
        for _ in range(packets):
            sctp._acknowledged_at_s = asyncio.get_running_loop().time() + 3600 if is_dense else 0.0
            await sctp._send_sack()
        if sctp._unacknowledged_packets:
            await until(lambda: sctp._unacknowledged_packets == 0)
        await wire.stop()
        await wire.other.stop()
        return wire.sent

    assert asyncio.run(acknowledged(16, is_dense=False)) == 8
    assert asyncio.run(acknowledged(16, is_dense=True)) == 2
    assert asyncio.run(acknowledged(7, is_dense=True)) == 1
    assert asyncio.run(acknowledged(1, is_dense=True)) == 1


@pytest.mark.parametrize("error", [ConnectionError(), SSL.Error([("SSL routines", "", "protocol is shutdown")])])
async def test_what_is_sent_while_the_transport_closes_hurts_nobody(error: Exception) -> None:
    complaints: list[dict[str, Any]] = []

    async def refuse(data: bytes) -> None:
        raise error

    async with associated() as link:
        asyncio.get_running_loop().set_exception_handler(lambda loop, context: complaints.append(context))
        channel = await link.channel()
        link.wires[0].fate = lambda: 0
        channel.send(b"lost")
        await until(lambda: link.ends[0]._t3_handle is not None)
        link.wires[0]._send_data = refuse  # type: ignore[method-assign]
        link.ends[0]._t3_due_s = 0.0
        link.ends[0]._t3_expired()
        channel.send(b"too late")
        await asyncio.sleep(0)
        await asyncio.sleep(0)
        gc.collect()  # a task whose error nobody took complains when it goes
        del link.wires[0]._send_data
    assert complaints == []


@given(st.lists(st.one_of(st.binary(max_size=40), st.none()), max_size=60))
def test_a_measured_queue_knows_what_waits_in_it(steps: list[bytes | None]) -> None:
    queue: MeasuredQueue[bytes] = MeasuredQueue(len)
    for step in steps:
        if step is not None:
            queue.append(step)
        elif queue:
            queue.popleft()
        assert queue.size_bytes == sum(map(len, queue))


async def test_what_waited_before_a_transport_was_quickened_is_counted() -> None:
    wire = Wire("client", always)
    sctp = RTCSctpTransport(wire)  # type: ignore[arg-type] # in place of DTLS
    RTCDataChannel(sctp, RTCDataChannelParameters(label="x"))
    queue = SctpQueue(sctp, lambda: None)
    before = queue.queued_bytes
    quicken(sctp)
    assert queue.queued_bytes == before > 0
    await wire.stop()


REWRITTEN = {
    (RTCSctpTransport, "_transmit"): "aa8941d5f8f0",
    (RTCSctpTransport, "_send_sack"): "ac92513522fa",
    (RTCSctpTransport, "_mark_received"): "2ac68b6a3934",
    (RTCSctpTransport, "_t3_restart"): "abf85ae57b8f",
    (RTCSctpTransport, "_t3_expired"): "0e759bf4b1b2",
    (RTCSctpTransport, "_data_channel_send"): "bff23b8d60ec",
    (RTCSctpTransport, "_data_channel_flush"): "d5f055f33db1",
    (RTCSctpTransport, "_update_rto"): "a1e7afb18886",
    (RTCSctpTransport, "_send_chunk"): "eb2f909e3c2f",
    (RTCSctpTransport, "_get_inbound_stream"): "7bb5d6a0225a",
    (InboundStream, "add_chunk"): "de934faf324b",
    (InboundStream, "prune_chunks"): "ff5a6cd9b68a",
    (InboundStream, "pop_messages"): "bd29de9aa7c4",
}
"""Ours do the same and more, or rely on what these do."""
LEANT_ON = {
    "_send": "f0f8aff63a9a",  # fills the outbound queue with append, then transmits
    "_receive_sack_chunk": "4b35ccf1372c",  # subtracts send times, flushes, then transmits
    "_update_advanced_peer_ack_point": "b10416e34e18",  # takes from the outbound queue with popleft
    "_receive_forward_tsn_chunk": "a7b72a09e9c4",  # asks for an acknowledgement and does not send it
    "_receive_data_chunk": "790c2bb8cd0f",  # adds a chunk to its stream, then takes what is whole
    "_data_channel_receive": "3df88b4b9c66",  # makes a channel for every request
    "_reset_deferred_streams": "e8a288bf5191",  # takes the streams out that the other side has reset
    "_t3_start": "fa045ec7c5ff",  # a timer under _t3_handle that calls _t3_expired of the instance
}


@pytest.mark.parametrize(("owner", "name", "digest"), [(*key, digest) for key, digest in REWRITTEN.items()])
def test_what_is_written_anew_here_is_as_it_was_read_in_aiortc(owner: type, name: str, digest: str) -> None:
    assert digest_of(owner, name) == digest, f"aiortc has changed {name}: read it, adapt QuickSctp and this digest"


@pytest.mark.parametrize(("name", "digest"), LEANT_ON.items())
def test_what_is_leant_on_is_as_it_was_read_in_aiortc(name: str, digest: str) -> None:
    assert digest_of(RTCSctpTransport, name) == digest, f"aiortc has changed {name}: read it again"


@pytest.mark.parametrize(
    "mark",
    [
        "_acked = False",
        "_book_size = len(chunk.user_data)",
        "_misses = 0",
        "_retransmit = False",
        "_sent_count = 0",
        "_sent_time = None",
    ],
)
def test_a_chunk_is_marked_when_it_is_queued(mark: str) -> None:
    assert f"chunk.{mark}" in inspect.getsource(RTCSctpTransport._send)


def test_a_channel_is_told_its_number_and_what_waits_in_it() -> None:
    assert list(inspect.signature(RTCDataChannel._setId).parameters) == ["self", "id"]
    assert list(inspect.signature(RTCDataChannel._addBufferedAmount).parameters) == ["self", "amount"]
    source = inspect.getsource(RTCDataChannel._addBufferedAmount)
    assert 'self.emit("bufferedamountlow")' in source


def digest_of(owner: type, name: str) -> str:
    return hashlib.sha256(inspect.getsource(getattr(owner, name)).encode()).hexdigest()[:12]


@pytest.mark.parametrize("error", [ConnectionError(), SSL.Error([("SSL routines", "", "protocol is shutdown")])])
def test_an_acknowledgement_that_comes_due_while_the_transport_closes_hurts_nobody(error: Exception) -> None:
    class Closing(QuickSctp):
        async def _acknowledge(self) -> None:
            raise error

    asyncio.run(Closing.__new__(Closing)._acknowledge_late())
