"""The frame around every message on a data channel whose DCEP protocol is ``mosaic.1``.

All integers are big-endian::

     0        1        2                 4
    +--------+--------+-----------------+
    | kind   | flags  | reserved (0)    |
    +--------+--------+-----------------+
    | seq u32: number of the message on this channel and direction, from 1, wraps to 0       |
    | epoch u32: lease epoch of a command, 0 where there is none                            |
    | stamp_us u64: sender's monotonic clock when the message was made                      |
    +-- only with flag CHUNKED -------------------------------------------------------------+
    | index u32 | count u32 | total_size u32 (bytes of the whole payload)                   |
    +---------------------------------------------------------------------------------------+
    | payload                                                                               |

A message larger than the channel takes is split; all its chunks carry the same header but for ``index``.
The golden bytes in ``tests/wire/frames.json`` are read by the TypeScript twin of this module too.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from enum import IntEnum, IntFlag

from mosaic_core.words.errors import WireError

_HEADER = struct.Struct("!BBHIIQ")
_CHUNK = struct.Struct("!III")
HEADER_BYTES = _HEADER.size
CHUNK_HEADER_BYTES = _CHUNK.size
SEQ_MODULUS = 1 << 32

MAX_MESSAGE_BYTES = 16 * 1024 * 1024
"""Largest message that a receiver reassembles."""
CHUNK_PAYLOAD_BYTES = 60 * 1024
"""A peer that announces no maximum takes 65 536 bytes (RFC 8841 §6.1)."""
MAX_CHUNKS = 4096
"""The largest message in chunks of 4 KiB: smaller ones would cost a receiver more in bookkeeping than in data."""
CHUNK_TIMEOUT_S = 5.0
"""A message whose chunks stop arriving for this long is forgotten."""


class PayloadKind(IntEnum):
    JSON = 1
    STRING = 2
    BYTES = 3


class FrameFlag(IntFlag):
    NONE = 0
    CHUNKED = 1
    LATCHED = 2
    """The last value, repeated for somebody who came later; ``stamp_us`` tells its age."""


@dataclass(frozen=True, slots=True)
class Frame:
    """One whole message."""

    kind: PayloadKind
    payload: bytes
    seq: int = 0
    epoch: int = 0
    stamp_us: int = 0
    flags: FrameFlag = FrameFlag.NONE


def encode_frame(frame: Frame, max_payload_bytes: int = CHUNK_PAYLOAD_BYTES) -> Iterator[bytes]:
    """The data-channel messages that carry ``frame``: one, or its chunks in order."""
    size = len(frame.payload)
    if size > MAX_MESSAGE_BYTES:
        raise ValueError(f"a message may have {MAX_MESSAGE_BYTES} bytes, this one has {size}")
    if size <= max_payload_bytes:
        yield _header(frame, frame.flags & ~FrameFlag.CHUNKED) + frame.payload
        return
    header = _header(frame, frame.flags | FrameFlag.CHUNKED)
    count = -(-size // max_payload_bytes)
    if count > MAX_CHUNKS:
        raise ValueError(f"{size} bytes make {count} chunks, {MAX_CHUNKS} are the most")
    for index in range(count):
        part = frame.payload[index * max_payload_bytes : (index + 1) * max_payload_bytes]
        yield header + _CHUNK.pack(index, count, size) + part


def _header(frame: Frame, flags: FrameFlag) -> bytes:
    return _HEADER.pack(frame.kind, flags, 0, frame.seq % SEQ_MODULUS, frame.epoch, frame.stamp_us)


@dataclass(slots=True)
class _Partial:
    header: bytes
    total_bytes: int
    touched_at_s: float
    parts: dict[int, bytes] = field(default_factory=dict)
    received_bytes: int = 0


class FrameReader:
    """Turns the messages of one channel back into frames; keeps at most ``max_partial`` unfinished ones.

    Not thread-safe; one instance per channel. Bad bytes raise :class:`WireError` and leave the reader usable.
    """

    def __init__(self, max_message_bytes: int = MAX_MESSAGE_BYTES, max_partial: int = 4) -> None:
        self._max_message_bytes = max_message_bytes
        self._max_partial = max_partial
        self._partial: dict[int, _Partial] = {}

    def read(self, data: bytes, now_s: float) -> Frame | None:
        """The frame that ``data`` completes, or ``None`` while chunks are missing. ``now_s``: any monotonic clock."""
        if len(data) < HEADER_BYTES:
            raise WireError("frame: shorter than its header")
        kind, flags, _reserved, seq, epoch, stamp_us = _HEADER.unpack_from(data)
        try:
            payload_kind = PayloadKind(kind)
        except ValueError:
            raise WireError(f"frame: unknown kind {kind}") from None
        flag = FrameFlag(flags)
        if flag & FrameFlag.CHUNKED:
            payload = self._collect(data, seq, now_s)
            if payload is None:
                return None
        else:
            payload = data[HEADER_BYTES:]
        return Frame(payload_kind, payload, seq, epoch, stamp_us, flag & ~FrameFlag.CHUNKED)

    def _collect(self, data: bytes, seq: int, now_s: float) -> bytes | None:
        if len(data) < HEADER_BYTES + CHUNK_HEADER_BYTES:
            raise WireError("frame: shorter than its chunk header")
        index, count, total = _CHUNK.unpack_from(data, HEADER_BYTES)
        part = data[HEADER_BYTES + CHUNK_HEADER_BYTES :]
        if not 0 < total <= self._max_message_bytes:
            raise WireError("frame: announced size out of range", code="channel.too_large")
        if not (index < count <= MAX_CHUNKS and len(part) > 0 and count <= total):
            raise WireError("frame: chunk index out of range")
        self._forget_stale(now_s)
        partial = self._partial.get(seq)
        if partial is None:
            if len(self._partial) >= self._max_partial:
                del self._partial[min(self._partial, key=lambda key: self._partial[key].touched_at_s)]
            partial = self._partial[seq] = _Partial(data[:HEADER_BYTES], total, now_s)
        if partial.total_bytes != total or partial.header != data[:HEADER_BYTES]:
            del self._partial[seq]
            raise WireError("frame: chunks of one message disagree")
        if index not in partial.parts:
            partial.parts[index] = part
            partial.received_bytes += len(part)
        partial.touched_at_s = now_s
        if partial.received_bytes < total and len(partial.parts) < count:
            return None
        del self._partial[seq]
        if partial.received_bytes != total or len(partial.parts) != count:
            raise WireError("frame: chunks do not add up")
        return b"".join(partial.parts[position] for position in range(count))

    def _forget_stale(self, now_s: float) -> None:
        stale = [seq for seq, partial in self._partial.items() if now_s - partial.touched_at_s > CHUNK_TIMEOUT_S]
        for seq in stale:
            del self._partial[seq]


def is_newer(seq: int, than: int) -> bool:
    """Serial-number comparison (RFC 1982) of two message numbers."""
    return 0 < (seq - than) % SEQ_MODULUS < SEQ_MODULUS // 2
