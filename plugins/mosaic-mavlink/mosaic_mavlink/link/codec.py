"""Makes MAVLink 2 frames of messages and messages of bytes, by pymavlink's generated dialects."""

from __future__ import annotations

import hashlib
import importlib
import re
import threading
import time
from collections import OrderedDict
from collections.abc import Callable, Iterator
from typing import Any, Literal, TypeAlias

from pymavlink.dialects.v20 import ardupilotmega as words

from mosaic_mavlink.link.address import Source

Dialect: TypeAlias = Literal["ardupilotmega", "common", "all", "development", "cubepilot", "storm32", "ASLUAV"]
SIGNING_EPOCH_S = 1_420_070_400
"""2015-01-01 UTC: signatures count units of 10 µs from there (MAVLink 2, message signing)."""
STALE_S = 0.5
"""A frame takes 0.3 s at 9600 baud: what was begun longer ago is garbage, and would swallow what comes."""
SHORTEST_FRAME_BYTES = 8
MAX_SOURCES = 16
_HEX_KEY = re.compile(r"^[0-9a-fA-F]{64}$")


def signing_key(secret: str) -> bytes | None:
    """The 32 bytes of a key: 64 hexadecimal digits, or the SHA-256 of a passphrase, as ground stations have it."""
    text = secret.strip()
    if not text:
        return None
    return bytes.fromhex(text) if _HEX_KEY.match(text) else hashlib.sha256(text.encode()).digest()


def named(group: str, number: int) -> str:
    """The name of ``number`` in an enum of the dialect without the enum's own: ``('MAV_STATE', 4)`` is ``active``."""
    entry = words.enums.get(group, {}).get(number)
    if entry is None or entry.name.endswith("_ENUM_END"):
        return f"{number}"
    return str(entry.name.removeprefix(f"{group}_")).lower()


class _Reader:
    """Finds messages in what one source sends."""

    def __init__(self, mav: Any) -> None:
        self._mav = mav
        self._mav.robust_parsing = True
        self._fed_s = float("-inf")

    def messages(self, data: bytes, now_s: float) -> Iterator[Any]:
        if now_s - self._fed_s > STALE_S:
            self._mav.buf, self._mav.buf_index = bytearray(), 0
            self._mav.expected_length, self._mav.have_prefix_error = SHORTEST_FRAME_BYTES, False
        self._fed_s = now_s
        yield from self._mav.parse_buffer(data) or ()


class MavlinkCodec:
    """Packs and reads the messages of one link. Reading: one thread; packing: any."""

    def __init__(self, dialect: str, system_id: int, component_id: int, key: bytes | None = None) -> None:
        module = importlib.import_module(f"pymavlink.dialects.v20.{dialect}")
        self._made: Callable[[], Any] = lambda: module.MAVLink(None, srcSystem=system_id, srcComponent=component_id)
        self._mav = self._made()
        self._readers: OrderedDict[Source, _Reader] = OrderedDict()
        self._lock = threading.Lock()
        self.bad_frames = 0
        """Pieces of what came that are no message: garbage, wrong checksums, wrong signatures."""
        if key is not None:
            self._mav.signing.secret_key = key
            self._mav.signing.sign_outgoing = True
            self._mav.signing.timestamp = int((time.time() - SIGNING_EPOCH_S) * 100_000)

    def messages(self, data: bytes, source: Source, now_s: float) -> Iterator[Any]:
        """Each whole message in what this source sent so far. Never raises for bytes that make no sense; those of
        one source cost another one nothing."""
        for message in self._reader(source).messages(data, now_s):
            kind = message.get_type()
            if kind == "BAD_DATA":
                self.bad_frames += 1
            elif not kind.startswith("UNKNOWN"):
                yield message

    def _reader(self, source: Source) -> _Reader:
        if source not in self._readers:
            while len(self._readers) >= MAX_SOURCES:
                self._readers.popitem(last=False)
            mav = self._made()
            mav.signing = self._mav.signing  # what was heard from one source is no news from another
            self._readers[source] = _Reader(mav)
        self._readers.move_to_end(source)
        return self._readers[source]

    def packed(self, name: str, fields: dict[str, Any]) -> bytes:
        """The frame of the message ``name`` in small letters, such as ``command_long``. Raises :class:`TypeError` for
        fields that it does not have."""
        with self._lock:
            message = getattr(self._mav, f"{name}_encode")(**fields)
            frame = bytes(message.pack(self._mav))
            self._mav.seq = (self._mav.seq + 1) % 256
            return frame
