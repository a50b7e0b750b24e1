"""What the other side of an association can make us keep is bounded, and what keeps to the bounds is never refused."""

from __future__ import annotations

from collections.abc import AsyncIterator

import pytest
from aiortc import RTCDataChannel
from aiortc.rtcsctptransport import (
    SCTP_DATA_FIRST_FRAG,
    SCTP_DATA_LAST_FRAG,
    SCTP_DATA_UNORDERED,
    WEBRTC_BINARY,
    WEBRTC_DCEP,
    DataChunk,
    RTCSctpTransport,
    StreamResetOutgoingParam,
)

from mosaic_core.adapters.aiortc_private.sctp import sctp_bounds
from mosaic_core.adapters.aiortc_private.sctp.quick_sctp import QuickSctp, quicken
from mosaic_core.adapters.aiortc_private.sctp.sctp_bounds import ALL_HELD, CHUNK_COST_BYTES

FIRST, LAST = SCTP_DATA_FIRST_FRAG, SCTP_DATA_LAST_FRAG
MIDDLE = 0


class Dtls:
    """In place of DTLS; what is sent goes nowhere."""

    state = "connected"
    _role = "server"

    def _register_data_receiver(self, receiver: object) -> None: ...
    def _unregister_data_receiver(self, receiver: object) -> None: ...
    async def _send_data(self, data: bytes) -> None: ...


class Attacked:
    """An association that gets whatever chunks a test makes up."""

    def __init__(self) -> None:
        self.refusals: list[str] = []
        self.sctp = RTCSctpTransport(Dtls())  # type: ignore[arg-type] # in place of DTLS
        quicken(self.sctp, self.refusals.append)
        assert isinstance(self.sctp, QuickSctp)
        self.sctp._last_received_tsn = self._tsn = 2**32 - 5
        self.sctp._remote_port = 5000
        self.sctp._set_state(self.sctp.State.ESTABLISHED)

    async def send(self, flags: int, data: bytes, *, stream: int = 0, skip: int = 0, protocol: int = 53) -> None:
        chunk = DataChunk(flags=flags)
        self._tsn = chunk.tsn = (self._tsn + 1 + skip) % 2**32
        chunk.stream_id, chunk.user_data, chunk.protocol = stream, data, protocol
        await self.sctp._receive_chunk(chunk)

    @property
    def held_bytes(self) -> int:
        return sum(
            len(chunk.user_data) + CHUNK_COST_BYTES
            for stream in self.sctp._inbound_streams.values()
            for chunk in stream.reassembly
        )

    def close(self) -> None:
        self.sctp._set_state(self.sctp.State.CLOSED)


@pytest.fixture
async def attacked() -> AsyncIterator[Attacked]:
    before_bytes = ALL_HELD.size_bytes
    association = Attacked()
    yield association
    association.close()
    assert ALL_HELD.size_bytes == before_bytes


async def test_a_message_that_never_ends_is_refused_before_it_has_cost_much(attacked: Attacked) -> None:
    before_bytes = most_bytes = ALL_HELD.size_bytes
    await attacked.send(FIRST, bytes(1100))
    for _ in range(10_000):
        await attacked.send(MIDDLE, bytes(1100))
        most_bytes = max(most_bytes, ALL_HELD.size_bytes)
    assert attacked.refusals == ["a message has more than 262144 bytes"]
    assert most_bytes - before_bytes < 400 * 1024
    assert attacked.held_bytes == 0


async def test_crumbs_of_messages_cost_as_much_as_they_take(attacked: Attacked) -> None:
    for number in range(30_000):
        await attacked.send(FIRST, b".", stream=number % 100)
        if number % 1000 == 0:
            assert attacked.held_bytes <= sctp_bounds.MAX_HELD_BYTES
    assert attacked.refusals == [f"what is not complete has more than {sctp_bounds.MAX_HELD_BYTES} bytes"]


async def test_many_streams_of_unfinished_messages_share_one_bound(attacked: Attacked) -> None:
    for stream in range(10_000):
        await attacked.send(FIRST, bytes(1100), stream=stream)
    assert len(attacked.refusals) == 1
    assert attacked.held_bytes == 0


async def test_all_connections_together_have_a_bound_and_who_holds_most_goes(
    attacked: Attacked, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(ALL_HELD, "_limit_bytes", ALL_HELD.size_bytes + 100_000)
    modest, others = attacked, [Attacked() for _ in range(3)]
    await modest.send(FIRST, bytes(1000))
    for _ in range(60):
        for other in others:
            await other.send(FIRST, bytes(1000))
    assert modest.refusals == []
    assert [len(other.refusals) for other in others].count(1) >= 2
    for other in others:
        other.close()


async def test_packets_far_behind_a_gap_are_not_taken_and_not_acknowledged(attacked: Attacked) -> None:
    for _ in range(3 * sctp_bounds.MAX_AHEAD // 100):
        await attacked.send(FIRST | LAST | SCTP_DATA_UNORDERED, b".", skip=100)
    assert len(attacked.sctp._sack_misordered) <= sctp_bounds.MAX_AHEAD // 100
    assert attacked.refusals == []


def opening(label: bytes) -> bytes:
    return b"\x03" + bytes(7) + len(label).to_bytes(2, "big") + bytes(2) + label


async def test_channels_are_counted(attacked: Attacked) -> None:
    came: list[RTCDataChannel] = []
    attacked.sctp.on("datachannel", came.append)
    for stream in range(600):
        await attacked.send(FIRST | LAST, opening(b"x"), stream=stream, protocol=WEBRTC_DCEP)
    assert len(came) == sctp_bounds.MAX_CHANNELS
    assert attacked.refusals == ["it has more than 512 channels"]


async def test_the_name_of_a_channel_is_a_few_words(attacked: Attacked) -> None:
    await attacked.send(FIRST | LAST, opening(b"x" * 60_000), protocol=WEBRTC_DCEP)
    assert attacked.refusals == ["the name of a channel is too long"]
    assert not attacked.sctp._data_channels


async def test_what_arrives_whole_holds_nothing_and_goes_on_for_ever(attacked: Attacked) -> None:
    messages: list[bytes] = []
    await attacked.send(FIRST | LAST, opening(b"x"), protocol=WEBRTC_DCEP)
    attacked.sctp._data_channels[0].on("message", messages.append)
    attacked.sctp._inbound_streams[0].sequence_number = 0
    for _ in range(300):
        await attacked.send(FIRST | SCTP_DATA_UNORDERED, bytes(60_000), protocol=WEBRTC_BINARY)
        await attacked.send(LAST | SCTP_DATA_UNORDERED, bytes(60_000), protocol=WEBRTC_BINARY)
        assert attacked.held_bytes == 0
    assert [len(message) for message in messages] == [120_000] * 300
    assert attacked.refusals == []


async def test_a_stream_that_is_reset_gives_back_what_it_held(attacked: Attacked) -> None:
    window_bytes = attacked.sctp._advertised_rwnd
    await attacked.send(FIRST, bytes(1000), stream=4)
    reset = StreamResetOutgoingParam(1, 0, attacked.sctp._last_received_tsn, [4])
    await attacked.sctp._receive_reconfig_param(reset)
    assert 4 not in attacked.sctp._inbound_streams
    assert (attacked.held_bytes, attacked.sctp._advertised_rwnd) == (0, window_bytes)
