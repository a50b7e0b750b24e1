"""What may go down to SCTP next, for one peer. SCTP has one queue for all channels and no priorities: so ours waits
here, where a newer value can still replace an older one and a stop can still overtake a map.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field
from enum import IntEnum

HIGH_WATER_BYTES = 64 * 1024
"""SCTP's own buffer is filled up to here: at 64 KiB a command waits a few milliseconds behind it (measured)."""
LOW_WATER_BYTES = 16 * 1024
"""Below this the adapter reports ``on_drained``, and a latest value may go: it leaves at once or is replaced here."""


class Lane(IntEnum):
    """Classes of traffic, most urgent first."""

    CONTROL = 0
    LATEST = 1
    RELIABLE = 2
    BULK = 3


@dataclass(frozen=True, slots=True)
class LaneLimits:
    """The most that may wait for one channel. One message is always taken while nothing waits."""

    messages: int
    size_bytes: int


LIMITS: dict[Lane, LaneLimits] = {
    Lane.CONTROL: LaneLimits(messages=1024, size_bytes=4 * 1024 * 1024),
    Lane.LATEST: LaneLimits(messages=1, size_bytes=16 * 1024 * 1024),
    Lane.RELIABLE: LaneLimits(messages=512, size_bytes=2 * 1024 * 1024),
    Lane.BULK: LaneLimits(messages=64, size_bytes=32 * 1024 * 1024),
}
_CEILING_BYTES: dict[Lane, int] = {
    Lane.CONTROL: 4 * HIGH_WATER_BYTES,
    Lane.LATEST: LOW_WATER_BYTES,
    Lane.RELIABLE: HIGH_WATER_BYTES,
    Lane.BULK: HIGH_WATER_BYTES // 2,
}
"""A lane sends only while fewer bytes than this wait below: bulk leaves room that reliable may use."""


@dataclass(frozen=True, slots=True)
class QueuedMessage:
    """One message: its data-channel messages in order (several if it is chunked), and the size of them all."""

    channel: str
    pieces: Iterator[bytes | str]
    size_bytes: int


class Offered(IntEnum):
    """What became of a message."""

    QUEUED = 0
    REPLACED = 1
    """Queued in place of an older value that nobody will see."""
    REFUSED = 2
    """The queue is full."""


@dataclass(slots=True)
class _Queue:
    lane: Lane
    waiting: deque[QueuedMessage] = field(default_factory=deque)
    size_bytes: int = 0
    current: Iterator[bytes | str] | None = None


@dataclass(slots=True)
class SchedulerCounters:
    sent_messages: int = 0
    sent_bytes: int = 0
    replaced: int = 0
    refused: int = 0


class SendScheduler:
    """The queues of one peer. Not thread-safe."""

    def __init__(self, limits: dict[Lane, LaneLimits] | None = None) -> None:
        self._limits = limits or LIMITS
        self._queues: dict[str, _Queue] = {}
        self._turns: dict[Lane, deque[str]] = {lane: deque() for lane in Lane}
        self.counters = SchedulerCounters()

    def open(self, channel: str, lane: Lane) -> None:
        """Messages for ``channel`` may be offered from now on; what an older one of that name left is forgotten."""
        self.close(channel)
        self._queues[channel] = _Queue(lane)
        self._turns[lane].append(channel)

    def close(self, channel: str) -> None:
        """The channel is gone, and what waited for it."""
        queue = self._queues.pop(channel, None)
        if queue is not None:
            self._turns[queue.lane].remove(channel)

    def offer(self, message: QueuedMessage) -> Offered:
        """Queue one message; :class:`KeyError` if its channel isn't open."""
        queue = self._queues[message.channel]
        limits = self._limits[queue.lane]
        if queue.lane is Lane.LATEST:
            replaced = bool(queue.waiting)
            queue.waiting.clear()
            queue.waiting.append(message)
            queue.size_bytes = message.size_bytes
            self.counters.replaced += replaced
            return Offered.REPLACED if replaced else Offered.QUEUED
        too_much = queue.size_bytes + message.size_bytes > limits.size_bytes
        if queue.waiting and (len(queue.waiting) >= limits.messages or too_much):
            self.counters.refused += 1
            return Offered.REFUSED
        queue.waiting.append(message)
        queue.size_bytes += message.size_bytes
        return Offered.QUEUED

    def take(self, buffered_bytes: int) -> tuple[str, bytes | str] | None:
        """The next ``(channel, piece)`` to send now, given how much waits below; ``None``: wait until it drains."""
        for lane in Lane:
            if buffered_bytes > 0 and buffered_bytes >= _CEILING_BYTES[lane]:
                continue
            turns = self._turns[lane]
            for _ in range(len(turns)):
                channel = turns[0]
                turns.rotate(-1)  # the channels of a lane take turns
                piece = self._next_piece(channel)
                if piece is not None:
                    return channel, piece
        return None

    def _next_piece(self, channel: str) -> bytes | str | None:
        queue = self._queues[channel]
        while True:
            if queue.current is not None:
                piece = next(queue.current, None)
                if piece is not None:
                    self.counters.sent_bytes += len(piece)
                    return piece
                queue.current = None
                self.counters.sent_messages += 1
            if not queue.waiting:
                return None
            message = queue.waiting.popleft()
            queue.size_bytes -= message.size_bytes
            queue.current = message.pieces

    @property
    def is_idle(self) -> bool:
        """Nothing waits."""
        return not any(queue.waiting or queue.current is not None for queue in self._queues.values())

    def has_room(self, channel: str) -> bool:
        """Less than half full: a sender that was refused may try again."""
        queue = self._queues.get(channel)
        if queue is None or not queue.waiting:
            return True
        limits = self._limits[queue.lane]
        return len(queue.waiting) * 2 <= limits.messages and queue.size_bytes * 2 <= limits.size_bytes

    def waiting(self, channel: str) -> int:
        """Messages that wait for ``channel``."""
        queue = self._queues.get(channel)
        return len(queue.waiting) if queue else 0
