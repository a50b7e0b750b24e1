"""The quicker SCTP: nothing is lost, doubled or mixed up, whoever is at the other end and however bad the path."""

from __future__ import annotations

import asyncio
import hashlib
import inspect
import random
from collections.abc import Callable, Coroutine
from typing import Any

import pytest
from aiortc import RTCDataChannel, RTCDataChannelParameters
from aiortc.rtcsctptransport import RTCSctpCapabilities, RTCSctpTransport
from hypothesis import given, settings
from hypothesis import strategies as st
from OpenSSL import SSL

from mosaic_core.adapters.aiortc_private.quick_sctp import QuickSctp, quicken
from mosaic_core.testing.joining import until

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


def associated(
    scenario: Callable[[Association], Coroutine[Any, Any, None]],
    *,
    fate: Callable[[], int] = always,
    quick: tuple[bool, bool] = (True, True),
) -> None:
    async def run() -> None:
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
            await scenario(association)
        finally:
            for wire in wires:
                wire.fate = always
            for end in ends:
                await end.stop()
            for wire in wires:
                await wire.stop()

    asyncio.run(asyncio.wait_for(run(), 3 * WAIT_S))


BOTH_WAYS = pytest.mark.parametrize("quick", [(True, True), (True, False), (False, True)], ids=str)


@BOTH_WAYS
def test_messages_of_all_sizes_arrive_in_order_and_whole(quick: tuple[bool, bool]) -> None:
    sizes = [1, 1000, 1160, 1161, 16_384, 200_000, 3, 65_536] * 3

    async def scenario(link: Association) -> None:
        channel = await link.channel()
        for number, size in enumerate(sizes):
            channel.send(bytes([number]) * size)
        for number, size in enumerate(sizes):
            assert await link.next() == bytes([number]) * size

    associated(scenario, quick=quick)


@pytest.mark.parametrize("seed", range(4))
@BOTH_WAYS
def test_loss_and_doubling_cost_time_but_no_message(quick: tuple[bool, bool], seed: int) -> None:
    chance = random.Random(seed)

    async def scenario(link: Association) -> None:
        channel = await link.channel()
        for number in range(60):
            channel.send(b"%d" % number + b"." * chance.randrange(4000))
        received = [(await link.next()).split(b".")[0] for _ in range(60)]  # type: ignore[arg-type] # bytes were sent
        assert received == [b"%d" % number for number in range(60)]
        assert link.came.empty()

    associated(scenario, fate=lambda: chance.choices((0, 1, 2), (3, 95, 2))[0], quick=quick)


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 2**32), loss=st.floats(0, 0.3))
def test_what_is_never_retransmitted_is_lost_or_right(seed: int, loss: float) -> None:
    chance = random.Random(seed)

    async def scenario(link: Association) -> None:
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

    associated(scenario, fate=lambda: int(chance.random() >= loss))


def test_half_of_the_packets_are_acknowledged_and_the_last_one_within_the_delay() -> None:
    async def scenario(link: Association) -> None:
        channel = await link.channel()
        before = [wire.sent for wire in link.wires]
        channel.send(b"x" * 1160 * 200)
        await link.next()
        await until(lambda: not link.ends[0]._sent_queue)
        data, acknowledgements = (wire.sent - sent for wire, sent in zip(link.wires, before, strict=True))
        assert data >= 200
        assert acknowledgements <= data * 0.6

    associated(scenario)


def test_a_path_that_was_dead_for_a_while_is_used_again_without_losing_anything() -> None:
    async def scenario(link: Association) -> None:
        channel = await link.channel()
        link.wires[0].fate = lambda: 0
        for number in range(20):
            channel.send(b"%d" % number)
        assert link.ends[0]._t3_handle is not None or link.ends[0]._outbound_queue
        with pytest.raises(TimeoutError):
            await asyncio.wait_for(link.came.get(), 0.1)
        link.wires[0].fate = always
        assert [await link.next() for _ in range(20)] == [b"%d" % number for number in range(20)]

    associated(scenario)


def test_a_transport_is_quickened_once_and_only_when_it_is_aiortcs_own() -> None:
    class Other(RTCSctpTransport):
        pass

    async def run() -> None:
        wire = Wire("client", always)
        sctp, other = RTCSctpTransport(wire), Other(wire)  # type: ignore[arg-type] # in place of DTLS
        quicken(sctp)
        window = sctp._cwnd
        sctp._cwnd += 1
        quicken(sctp)
        quicken(other)
        assert (type(sctp), sctp._cwnd, type(other)) == (QuickSctp, window + 1, Other)
        await wire.stop()

    asyncio.run(run())


REWRITTEN = {
    "_transmit": "aa8941d5f8f0",
    "_send_sack": "ac92513522fa",
    "_mark_received": "2ac68b6a3934",
    "_t3_restart": "abf85ae57b8f",
    "_t3_expired": "0e759bf4b1b2",
}


@pytest.mark.parametrize(("name", "digest"), REWRITTEN.items())
def test_what_is_written_anew_here_is_as_it_was_read_in_aiortc(name: str, digest: str) -> None:
    source = inspect.getsource(getattr(RTCSctpTransport, name))
    changed = f"aiortc has changed {name}: read it again, then adapt QuickSctp and this digest"
    assert hashlib.sha256(source.encode()).hexdigest()[:12] == digest, changed


@pytest.mark.parametrize("error", [ConnectionError(), SSL.Error([("SSL routines", "", "protocol is shutdown")])])
def test_an_acknowledgement_that_comes_due_while_the_transport_closes_hurts_nobody(error: Exception) -> None:
    class Closing(QuickSctp):
        async def _acknowledge(self) -> None:
            raise error

    asyncio.run(Closing.__new__(Closing)._acknowledge_late())
