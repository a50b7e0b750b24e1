"""The frame around every message of our own data channels."""

from __future__ import annotations

import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.delivery.framing import (
    HEADER_BYTES,
    SEQ_MODULUS,
    Frame,
    FrameFlag,
    FrameReader,
    PayloadKind,
    encode_frame,
    is_newer,
)
from mosaic_core.machines.delivery.reassembly import CHUNK_TIMEOUT_S, MAX_CHUNKS, MAX_MESSAGE_BYTES
from mosaic_core.words.errors import WireError

frames = st.builds(
    Frame,
    kind=st.sampled_from(PayloadKind),
    payload=st.binary(max_size=300),
    seq=st.integers(0, SEQ_MODULUS - 1),
    epoch=st.integers(0, SEQ_MODULUS - 1),
    stamp_us=st.integers(0, 2**64 - 1),
    flags=st.sampled_from([FrameFlag.NONE, FrameFlag.LATCHED]),
)


@given(frame=frames, chunk_bytes=st.integers(1, 310), shuffle=st.randoms(use_true_random=False))
def test_a_frame_survives_any_chunking_and_order(frame: Frame, chunk_bytes: int, shuffle: random.Random) -> None:
    parts = list(encode_frame(frame, chunk_bytes))
    shuffle.shuffle(parts)
    reader = FrameReader()
    read = [reader.read(part, 0.0) for part in parts]
    assert read[:-1] == [None] * (len(parts) - 1)
    assert read[-1] == frame


@given(st.binary(max_size=64))
def test_any_bytes_are_a_frame_or_a_wire_error(data: bytes) -> None:
    reader = FrameReader()
    try:
        reader.read(data, 0.0)
    except WireError:
        assert next(encode_frame(Frame(PayloadKind.JSON, b"{}")))
    assert reader.read(next(encode_frame(Frame(PayloadKind.JSON, b"{}", seq=1))), 0.0) is not None


def chunks(size: int, seq: int = 1) -> list[bytes]:
    return list(encode_frame(Frame(PayloadKind.BYTES, b"x" * size, seq=seq), 10))


def test_a_repeated_chunk_is_counted_once() -> None:
    first, second = chunks(20)
    reader = FrameReader()
    assert [reader.read(part, 0.0) for part in (first, first)] == [None, None]
    assert reader.read(second, 0.0) is not None


def test_an_unfinished_message_is_forgotten_after_the_time_out() -> None:
    first, second = chunks(20)
    reader = FrameReader(is_lossy=True)
    reader.read(first, 0.0)
    reader.read(chunks(20, seq=2)[0], CHUNK_TIMEOUT_S + 0.1)
    assert reader.read(second, CHUNK_TIMEOUT_S + 0.1) is None


def test_on_a_lossy_channel_a_complete_value_makes_the_parts_of_older_ones_worthless() -> None:
    reader = FrameReader(is_lossy=True)
    (old_first, old_second), (first, second) = chunks(20, seq=1), chunks(20, seq=2)
    reader.read(old_first, 0.0)
    assert [reader.read(part, 0.0) is not None for part in (first, second)] == [False, True]
    assert [reader.read(part, 0.0) for part in (old_first, old_second)] == [None, None]
    assert not tuple(reader.chunks.unfinished())


def test_where_nothing_gets_lost_an_older_message_may_be_completed_after_a_newer_one() -> None:
    reader = FrameReader()
    (old_first, old_second), (first, second) = chunks(20, seq=1), chunks(20, seq=2)
    for part in (old_first, first):
        assert reader.read(part, 0.0) is None
    assert [part is not None for part in (reader.read(second, 0.0), reader.read(old_second, 0.0))] == [True, True]


def test_only_so_many_unfinished_messages_are_kept() -> None:
    reader = FrameReader(max_partial=2)
    for seq in range(3):
        reader.read(chunks(20, seq)[0], float(seq) / 10)
    assert reader.read(chunks(20, 0)[1], 0.4) is None, "the oldest was dropped"
    assert reader.read(chunks(20, 2)[1], 0.4) is not None


def test_chunks_that_disagree_are_refused_and_forgotten() -> None:
    reader = FrameReader()
    reader.read(chunks(20)[0], 0.0)
    with pytest.raises(WireError, match="disagree"):
        reader.read(chunks(30)[1], 0.0)
    reader.read(chunks(20)[0], 0.0)
    with pytest.raises(WireError, match="add up"):
        reader.read(chunks(20)[1] + b"more", 0.0)


@pytest.mark.parametrize("size", [0, HEADER_BYTES - 1])
def test_too_few_bytes_are_refused(size: int) -> None:
    with pytest.raises(WireError, match="shorter"):
        FrameReader().read(b"\1" * size, 0.0)


def test_an_announced_size_beyond_the_limit_is_refused_before_memory_is_taken() -> None:
    with pytest.raises(WireError) as caught:
        FrameReader(max_message_bytes=15).read(chunks(20)[0], 0.0)
    assert caught.value.code == "channel.too_large"


def test_a_message_in_crumbs_is_refused_before_they_are_kept() -> None:
    crumb = bytearray(chunks(20)[0])
    crumb[HEADER_BYTES + 4 : HEADER_BYTES + 12] = (MAX_CHUNKS + 1).to_bytes(4, "big") + (MAX_CHUNKS + 1).to_bytes(
        4, "big"
    )
    with pytest.raises(WireError, match="out of range"):
        FrameReader().read(bytes(crumb), 0.0)
    with pytest.raises(ValueError, match="chunks"):
        next(encode_frame(Frame(PayloadKind.BYTES, bytes(MAX_CHUNKS + 1)), 1))


def test_a_message_beyond_the_limit_is_not_sent() -> None:
    with pytest.raises(ValueError, match="may have"):
        next(encode_frame(Frame(PayloadKind.BYTES, bytes(MAX_MESSAGE_BYTES + 1))))


@given(st.integers(0, SEQ_MODULUS - 1), st.integers(1, SEQ_MODULUS // 2 - 1))
def test_newer_is_newer_across_the_wrap(seq: int, step: int) -> None:
    later = (seq + step) % SEQ_MODULUS
    assert is_newer(later, seq)
    assert not is_newer(seq, later)
    assert not is_newer(seq, seq)


def test_the_kinds_of_a_payload_have_their_numbers_on_the_wire() -> None:
    assert {kind.name: kind.value for kind in PayloadKind} == {"JSON": 1, "STRING": 2, "BYTES": 3}


def test_what_just_fits_is_one_message_and_a_byte_more_makes_two() -> None:
    whole, chunks = (list(encode_frame(Frame(PayloadKind.BYTES, bytes(size)), 100)) for size in (100, 101))
    assert len(whole) == 1
    assert len(chunks) == 2
    assert len(whole[0]) < len(chunks[0]), "a whole message has no number of its chunk"
