"""Reads signals out of frames, and knows which of them are too old to be shown. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import can
from can.util import dlc2len, len2dlc
from cantools.database import DecodeError
from cantools.database.can import Message as Described

from mosaic_can.databases import FrameKey
from mosaic_can.signal_fields import field_names, read_value


class SignalReader:
    """Holds the newest values of ``messages``, by name. What can't be read is told by :meth:`feed`."""

    def __init__(self, messages: Mapping[str, Described], stale_s: float) -> None:
        self._messages = {(one.frame_id, one.is_extended_frame): one for one in messages.values()}
        self._groups = field_names(messages)
        self._fields = {name: field_names(signal.name for signal in one.signals) for name, one in messages.items()}
        self._signals = {name: {signal.name: signal for signal in one.signals} for name, one in messages.items()}
        self._stale_s = stale_s
        self._values: dict[str, dict[str, Any]] = {}
        self._heard_at_s: dict[str, dict[str, float]] = {}

    def knows(self, frame: can.Message) -> bool:
        return (frame.arbitration_id, frame.is_extended_id) in self._messages

    def feed(self, frames: Iterable[can.Message], now_s: float) -> Iterator[str]:
        """Take in what came until now; why each frame that makes no sense doesn't. Of frames that say the same, the
        last one counts, and the others are not even read."""
        newest: dict[FrameKey, list[can.Message]] = {}
        for frame in frames:
            key = (frame.arbitration_id, frame.is_extended_id)
            described = self._messages.get(key)
            wrong = _fault(frame, described)
            if wrong is not None or described is None:
                yield wrong or ""
            elif described.is_multiplexed():
                newest.setdefault(key, []).append(frame)
            else:
                newest[key] = [frame]
        for key, its in newest.items():
            for frame in its:
                yield from self._read(self._messages[key], frame, now_s)

    def _read(self, described: Described, frame: can.Message, now_s: float) -> Iterator[str]:
        try:
            decoded = described.decode(bytes(frame.data)[: described.length])
        except (DecodeError, KeyError, ValueError) as error:
            yield f"{described.name}: {error}"
            return
        assert isinstance(decoded, dict)
        signals, names = self._signals[described.name], self._fields[described.name]
        values = self._values.setdefault(described.name, dict.fromkeys(names.values()))
        for name, value in decoded.items():
            values[names[name]] = read_value(signals[name], value)
            self._heard_at_s.setdefault(described.name, {})[names[name]] = now_s

    def snapshot(self, now_s: float) -> dict[str, Any]:
        """Every message by its field: what is too old, or was never heard, is ``None``."""
        return {self._groups[name]: self._fresh(name, now_s) for name in self._groups}

    def _fresh(self, name: str, now_s: float) -> dict[str, Any] | None:
        heard = self._heard_at_s.get(name, {})
        if all(now_s - at_s > self._stale_s for at_s in heard.values()):
            return None
        values = self._values[name].items()
        return {key: value if now_s - heard.get(key, float("-inf")) <= self._stale_s else None for key, value in values}


def _fault(frame: can.Message, described: Described | None) -> str | None:
    if described is None:
        return f"no message of the DBC file has the id {frame.arbitration_id:#x}"
    if frame.is_remote_frame:
        return f"{described.name}: a remote frame, which brings no data"
    if len(frame.data) != _length_on_bus(frame, described):
        return f"{described.name} has {len(frame.data)} bytes instead of {described.length}"
    return None


def _length_on_bus(frame: can.Message, described: Described) -> int:
    """CAN FD has only some lengths above 8 bytes: a message is filled up to the next one."""
    return dlc2len(len2dlc(described.length)) if frame.is_fd else described.length
