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
from dataclasses import dataclass
from enum import IntEnum, IntFlag

from mosaic_core.machines.delivery.reassembly import (
    CHUNK_TIMEOUT_S,
    MAX_CHUNKS,
    MAX_MESSAGE_BYTES,
    MAX_PARTIAL,
    RELIABLE_CHUNK_TIMEOUT_S,
    Chunk,
    ChunkCollector,
    Partials,
)
from mosaic_core.words.data_type import MosaicDataType
from mosaic_core.words.errors import WireError

_HEADER = struct.Struct("!BBHIIQ")
_CHUNK = struct.Struct("!III")
HEADER_BYTES = _HEADER.size
"""Before the payload of every message: kind, flags, number, epoch, time."""
CHUNK_HEADER_BYTES = _CHUNK.size
"""More of it on a chunk: which one of how many, and the size of the whole."""
SEQ_MODULUS = 1 << 32

CHUNK_PAYLOAD_BYTES = 60 * 1024
"""The largest payload that goes in one: a peer that announces no maximum takes 65 536 bytes (RFC 8841 §6.1)."""
SENT_CHUNK_BYTES = 16 * 1024
"""What a robot cuts: nothing overtakes a chunk, and on a slow path 60 KiB would be half a second of waiting."""


class PayloadKind(IntEnum):
    """What the payload of a frame is, its first byte."""

    JSON = 1
    STRING = 2
    BYTES = 3


_KIND_OF = {"json": PayloadKind.JSON, "string": PayloadKind.STRING, "byte": PayloadKind.BYTES}


def kind_of(data_type: MosaicDataType) -> PayloadKind:
    """The kind of payload that a data channel of this data type carries."""
    return _KIND_OF[data_type.split("-")[0]]


class FrameFlag(IntFlag):
    """Flags in a frame's header: how its payload is to be read."""

    NONE = 0
    CHUNKED = 1
    """A part of a message; the chunk header says which."""
    LATCHED = 2
    """The last value, repeated for somebody who came later; ``stamp_us`` tells its age."""


_KINDS = {int(kind): kind for kind in PayloadKind}
_CHUNKED, _LATCHED = int(FrameFlag.CHUNKED), int(FrameFlag.LATCHED)
_FLAGS = {0: FrameFlag.NONE, _LATCHED: FrameFlag.LATCHED}
"""Looked up for every message: what an enumeration does by itself costs more than all the rest."""


@dataclass(frozen=True, slots=True)
class Frame:
    """A whole message with its frame header."""

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
        yield _header(frame, int(frame.flags) & _LATCHED) + frame.payload
        return
    header = _header(frame, int(frame.flags) & _LATCHED | _CHUNKED)
    count = -(-size // max_payload_bytes)
    if count > MAX_CHUNKS:
        raise ValueError(f"{size} bytes make {count} chunks, {MAX_CHUNKS} are the most")
    for index in range(count):
        part = frame.payload[index * max_payload_bytes : (index + 1) * max_payload_bytes]
        yield header + _CHUNK.pack(index, count, size) + part


def _header(frame: Frame, flags: int) -> bytes:
    return _HEADER.pack(frame.kind, flags, 0, frame.seq % SEQ_MODULUS, frame.epoch, frame.stamp_us)


class FrameReader:
    """Turns the messages of one channel back into frames. Not thread-safe; bad bytes raise :class:`WireError` and leave
    the reader usable.

    ``is_lossy``: messages may get lost on this channel, and older values are worthless: parts of them are not kept once
    a newer one is complete. ``partials``: shared by all readers of one peer, so that its bound holds for all of them.
    """

    def __init__(
        self,
        max_message_bytes: int = MAX_MESSAGE_BYTES,
        max_partial: int = MAX_PARTIAL,
        *,
        is_lossy: bool = False,
        partials: Partials | None = None,
    ) -> None:
        self._is_lossy = is_lossy
        timeout_s = CHUNK_TIMEOUT_S if is_lossy else RELIABLE_CHUNK_TIMEOUT_S
        self.chunks = ChunkCollector(partials or Partials(), max_message_bytes, max_partial, timeout_s)
        """What is unfinished, and what was forgotten."""
        self._newest: int | None = None

    def read(self, data: bytes, now_s: float) -> Frame | None:
        """The frame that ``data`` completes, or ``None`` while chunks are missing. ``now_s``: any monotonic clock."""
        if len(data) < HEADER_BYTES:
            raise WireError("frame: shorter than its header")
        kind, flags, _reserved, seq, epoch, stamp_us = _HEADER.unpack_from(data)
        payload_kind = _KINDS.get(kind)
        if payload_kind is None:
            raise WireError(f"frame: unknown kind {kind}")
        if flags & _CHUNKED:
            payload = self._collect(data, seq, now_s)
            if payload is None:
                return None
        else:
            payload = data[HEADER_BYTES:]
        if self._is_lossy:
            self._supersede(seq)
        return Frame(payload_kind, payload, seq, epoch, stamp_us, _FLAGS[flags & _LATCHED])

    def _collect(self, data: bytes, seq: int, now_s: float) -> bytes | None:
        if len(data) < HEADER_BYTES + CHUNK_HEADER_BYTES:
            raise WireError("frame: shorter than its chunk header")
        if self._is_lossy and self._newest is not None and is_newer(self._newest, seq):
            return None
        index, count, total_bytes = _CHUNK.unpack_from(data, HEADER_BYTES)
        part = data[HEADER_BYTES + CHUNK_HEADER_BYTES :]
        return self.chunks.add(seq, Chunk(data[:HEADER_BYTES], index, count, total_bytes, part), now_s)

    def _supersede(self, seq: int) -> None:
        """A newer value is complete: parts of older ones are worth nothing."""
        if self._newest is None or is_newer(seq, self._newest):
            self._newest = seq
            for older in self.chunks.unfinished():
                if is_newer(seq, older):
                    self.chunks.drop(older)


def is_newer(seq: int, than: int) -> bool:
    """Serial-number comparison (RFC 1982) of two message numbers."""
    return 0 < (seq - than) % SEQ_MODULUS < SEQ_MODULUS // 2
