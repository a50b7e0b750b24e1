"""Decides which message goes down to SCTP next, for one peer. SCTP has one queue for all channels and no priorities: so
ours waits here, where a newer value can still replace an older one and a stop can still overtake a map.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field
from enum import IntEnum
from heapq import heappop, heappush

HIGH_WATER_BYTES = 64 * 1024
"""SCTP's own buffer is filled up to here: at 64 KiB a command waits a few milliseconds behind it (measured)."""
LOW_WATER_BYTES = 16 * 1024
"""Below this the adapter reports ``on_drained``, and a latest value may go: it leaves at once or is replaced here."""
PIECE_COST_BYTES = 64
"""What a piece costs the link beside its payload (SCTP, DTLS, UDP and IP headers); counted for fairness only."""


class Priority(IntEnum):
    """Classes of traffic, most urgent first."""

    CONTROL = 0
    LATEST = 1
    RELIABLE = 2
    BULK = 3


@dataclass(frozen=True, slots=True)
class QueueLimits:
    """The most that may wait for one channel. One message is always taken while nothing waits.

    ``newest_wins``: a full queue loses its oldest message to a newer one instead of refusing that.
    """

    messages: int
    size_bytes: int
    newest_wins: bool = False


LIMITS: dict[Priority, QueueLimits] = {
    Priority.CONTROL: QueueLimits(messages=1024, size_bytes=4 * 1024 * 1024),
    Priority.LATEST: QueueLimits(messages=1, size_bytes=16 * 1024 * 1024, newest_wins=True),
    Priority.RELIABLE: QueueLimits(messages=512, size_bytes=2 * 1024 * 1024),
    Priority.BULK: QueueLimits(messages=64, size_bytes=32 * 1024 * 1024),
}
LEAST_HIGH_WATER_BYTES = 8 * 1024
_QUARTERS: dict[Priority, int] = {Priority.CONTROL: 16, Priority.LATEST: 1, Priority.RELIABLE: 4, Priority.BULK: 2}
"""A priority sends only while fewer quarters of the high water wait below. The lowest ceiling of those who have
something to send is everybody's but control's: the buffer would never come down to it else."""
_SHARES: dict[Priority, int] = {Priority.LATEST: 16, Priority.RELIABLE: 4, Priority.BULK: 1}
"""How the priorities below control divide a link that they outrun, by bytes: nobody starves, whoever sends too much."""


@dataclass(frozen=True, slots=True)
class QueuedMessage:
    """One message: its data-channel messages in order (several if it is chunked), and the size of them all."""

    channel: str
    pieces: Iterator[bytes | str]
    size_bytes: int


class Offered(IntEnum):
    """The answer of a send queue to a message that was offered."""

    QUEUED = 0
    REPLACED = 1
    """Queued in place of an older one that nobody will see."""
    REFUSED = 2
    """The queue is full."""


@dataclass(slots=True, eq=False)
class _Queue:
    channel: str
    priority: Priority
    limits: QueueLimits
    waiting: deque[QueuedMessage] = field(default_factory=deque)
    size_bytes: int = 0
    current: Iterator[bytes | str] = field(default_factory=lambda: iter(()))
    ahead: bytes | str | None = None
    """The next piece of the message that is being sent."""
    served_bytes: int = 0
    """Its place among its priority: who has been served least goes first."""
    has_turn: bool = False

    @property
    def has_more(self) -> bool:
        return self.ahead is not None or bool(self.waiting)


@dataclass(slots=True)
class SchedulerCounters:
    """Counts what a scheduler sent, replaced and refused."""

    sent_bytes: int = 0
    replaced: int = 0
    refused: int = 0


class SendScheduler:
    """Queues the messages to one peer, and decides which goes next. Not thread-safe.

    The channels of a priority share it by bytes: by turns, a channel of large pieces would take all but the crumbs
    from one of small messages. The priorities below control share the link in the same way, by weight, the most urgent
    first among equals. Who was idle joins where the others are, and earns nothing by having waited.
    """

    def __init__(self) -> None:
        self._queues: dict[str, _Queue] = {}
        self._turns: dict[Priority, list[tuple[int, int, _Queue]]] = {priority: [] for priority in Priority}
        self._reached_bytes: dict[Priority, int] = dict.fromkeys(Priority, 0)
        self._served: dict[Priority, float] = dict.fromkeys(_SHARES, 0.0)
        self._reached = 0.0
        self._number = 0
        self.counters = SchedulerCounters()

    def open(self, channel: str, priority: Priority, limits: QueueLimits | None = None) -> None:
        """Messages for ``channel`` may be offered from now on; what an older one of that name left is forgotten."""
        self.close(channel)
        self._queues[channel] = _Queue(channel, priority, limits or LIMITS[priority])

    def close(self, channel: str) -> None:
        """The channel is gone, and what waited for it."""
        queue = self._queues.pop(channel, None)
        if queue is not None:
            queue.waiting.clear()
            queue.ahead = None

    def offer(self, message: QueuedMessage) -> Offered:
        """Queue one message; :class:`KeyError` if its channel isn't open."""
        queue = self._queues[message.channel]
        limits, offered = queue.limits, Offered.QUEUED
        while queue.waiting and (
            len(queue.waiting) >= limits.messages or queue.size_bytes + message.size_bytes > limits.size_bytes
        ):
            if not limits.newest_wins:
                self.counters.refused += 1
                return Offered.REFUSED
            queue.size_bytes -= queue.waiting.popleft().size_bytes
            self.counters.replaced += 1
            offered = Offered.REPLACED
        queue.waiting.append(message)
        queue.size_bytes += message.size_bytes
        if not queue.has_turn:
            queue.served_bytes = max(queue.served_bytes, self._reached_bytes[queue.priority])
            self._take_turn(queue)
        return offered

    def _take_turn(self, queue: _Queue) -> None:
        queue.has_turn = True
        turns = self._turns[queue.priority]
        if not turns and queue.priority in self._served:
            self._served[queue.priority] = max(self._served[queue.priority], self._reached)
        self._number += 1  # among equals, who came first
        heappush(turns, (queue.served_bytes, self._number, queue))

    def take(self, buffered_bytes: int, window_bytes: int | None = None) -> tuple[str, bytes | str] | None:
        """The next ``(channel, piece)`` to send now, given how much waits below; ``None``: wait until it drains.

        ``window_bytes`` may be on their way at a time: on a slow path so much less waits below.
        """
        quarter_bytes = high_water_bytes(window_bytes) // 4
        if buffered_bytes < _QUARTERS[Priority.CONTROL] * quarter_bytes:
            taken = self._take_from(Priority.CONTROL)
            if taken is not None:
                return taken
        priorities = [priority for priority in _SHARES if self._turns[priority]]
        if not priorities or buffered_bytes >= min(_QUARTERS[priority] for priority in priorities) * quarter_bytes:
            return None
        for priority in sorted(priorities, key=self._served.__getitem__):
            taken = self._take_from(priority)
            if taken is not None:
                self._reached = self._served[priority]
                self._served[priority] += (len(taken[1]) + PIECE_COST_BYTES) / _SHARES[priority]
                return taken
        return None

    def _take_from(self, priority: Priority) -> tuple[str, bytes | str] | None:
        turns = self._turns[priority]
        while turns:
            _, _, queue = heappop(turns)
            queue.has_turn = False
            piece = self._next_piece(queue)
            if piece is None:
                continue
            self._reached_bytes[priority] = queue.served_bytes
            queue.served_bytes += len(piece) + PIECE_COST_BYTES
            if queue.has_more:
                self._take_turn(queue)
            return queue.channel, piece
        return None

    def _next_piece(self, queue: _Queue) -> bytes | str | None:
        while queue.ahead is None:
            if not queue.waiting:
                return None
            message = queue.waiting.popleft()
            queue.size_bytes -= message.size_bytes
            queue.current = message.pieces
            queue.ahead = next(queue.current, None)
        piece, queue.ahead = queue.ahead, next(queue.current, None)
        self.counters.sent_bytes += len(piece)
        return piece

    @property
    def is_idle(self) -> bool:
        """Nothing waits."""
        return not any(queue.has_more for queue in self._queues.values())

    def has_room(self, channel: str) -> bool:
        """Less than half full: a sender that was refused may try again."""
        queue = self._queues.get(channel)
        if queue is None or not queue.waiting:
            return True
        limits = queue.limits
        return len(queue.waiting) * 2 <= limits.messages and queue.size_bytes * 2 <= limits.size_bytes

    def waiting(self, channel: str) -> tuple[int, int]:
        """``(messages, bytes)`` that wait for ``channel``, whose sending has not begun."""
        queue = self._queues.get(channel)
        return (len(queue.waiting), queue.size_bytes) if queue else (0, 0)


def high_water_bytes(window_bytes: int | None) -> int:
    """How much may wait in SCTP's own buffer: a quarter of what may be on its way, so that the path never idles and
    nothing waits there for more than a quarter of a round trip; at most :data:`HIGH_WATER_BYTES`."""
    if window_bytes is None:
        return HIGH_WATER_BYTES
    return max(LEAST_HIGH_WATER_BYTES, min(HIGH_WATER_BYTES, window_bytes // 4))
