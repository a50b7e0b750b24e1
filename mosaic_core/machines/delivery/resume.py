"""The two ends of a reliable channel that outlives its connection: the sender keeps and repeats what the receiver has
not told to have, the receiver drops what comes twice and counts what never comes.

Messages are numbered (RFC 1982 serial numbers of 32 bits, from 1) across all connections of one session. When a new
connection is up each receiver says the highest number that it has, and each sender which one will come next; only then
data flows again. So every accepted message arrives exactly once and in order, or both ends count it as lost.
The TypeScript twin replays the same vectors (``tests/wire/resume.json``).
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import Generic, TypeVar

from mosaic_core.machines.delivery.framing import SEQ_MODULUS, is_newer

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class ResumeLimits:
    """The most that may wait for one channel and direction, and how long something may wait for a connection.
    ``in_flight_…``: what is kept besides on a live connection, of which the receiver has not told yet that it came."""

    messages: int = 512
    size_bytes: int = 2 * 1024 * 1024
    age_s: float = 60.0
    in_flight_messages: int = 4096
    in_flight_bytes: int = 16 * 1024 * 1024


@dataclass(frozen=True, slots=True)
class Numbered(Generic[T]):
    """One message with its number. ``is_repeated``: it went out before, on a connection that was lost."""

    seq: int
    item: T
    is_repeated: bool = False


@dataclass(slots=True)
class _Kept(Generic[T]):
    seq: int
    item: T
    size_bytes: int
    at_s: float
    was_sent: bool = False


class ResumeSender(Generic[T]):
    """The sending end. ``lost`` and ``resent`` count messages since it was made. ``now_s``: any monotonic clock."""

    def __init__(self, limits: ResumeLimits | None = None) -> None:
        self._limits = limits or ResumeLimits()
        self._kept: deque[_Kept[T]] = deque()
        self._size_bytes = 0
        self._sent = 0
        self._next = 1
        self._confirmed = 0
        self._was_attached = False
        self.is_attached = False
        """Messages may go out now."""
        self.lost = 0
        self.resent = 0

    @property
    def waiting(self) -> int:
        """Messages that have not gone out on this connection."""
        return len(self._kept) - self._sent

    @property
    def unconfirmed(self) -> int:
        """Messages that are kept."""
        return len(self._kept)

    @property
    def size_bytes(self) -> int:
        """Bytes that are kept."""
        return self._size_bytes

    @property
    def next_seq(self) -> int:
        """The number of the next message that is accepted."""
        return self._next

    @property
    def first_seq(self) -> int:
        """The number that would come first on a new connection."""
        return self._kept[0].seq if self._kept else self._next

    def has_room(self, size_bytes: int, now_s: float) -> bool:
        """Whether a message would be accepted. One always is where nothing is kept."""
        self.forget_old(now_s)
        return not self._kept or not self._is_full(size_bytes)

    def accept(self, item: T, size_bytes: int, now_s: float) -> bool:
        """Number and keep a message; ``False`` if there is no room. What was accepted is kept until it is confirmed."""
        if not self.has_room(size_bytes, now_s):
            return False
        self._kept.append(_Kept(self._next, item, size_bytes, now_s))
        self._size_bytes += size_bytes
        self._next = _after(self._next)
        return True

    def forget_old(self, now_s: float) -> None:
        """What has waited too long for a connection is lost; say so before :meth:`resumed`."""
        while not self.is_attached and self._kept and now_s - self._kept[0].at_s > self._limits.age_s:
            self._drop_first()

    def upcoming(self) -> Numbered[T] | None:
        """What has to go out next; :meth:`went_out` says that it did."""
        if not self.is_attached or self._sent >= len(self._kept):
            return None
        kept = self._kept[self._sent]
        return Numbered(kept.seq, kept.item, kept.was_sent)

    def went_out(self) -> None:
        """The :meth:`upcoming` message is on its way."""
        kept = self._kept[self._sent]
        self.resent += kept.was_sent
        kept.was_sent = True
        self._sent += 1

    def delivered(self, seq: int) -> None:
        """The receiver has everything up to ``seq``; a number that was never sent is not believed."""
        if not self.is_attached or is_newer(seq, self._last_sent):
            return
        self._confirm(seq)

    def all_delivered(self) -> None:
        """The receiver has everything that went out."""
        self.delivered(self._last_sent)

    def detached(self) -> None:
        """The connection is gone; from now on messages wait."""
        self.is_attached = False
        self._sent = 0

    def resumed(self, received: int | None) -> int:
        """A new connection is up, whose receiver has everything up to ``received``; ``None``: it remembers nothing, so
        what went out may have acted and is not repeated. The number of messages that are lost by now."""
        is_first = not self._was_attached
        self._was_attached = self.is_attached = True
        self._sent = 0
        if received is None:
            return self._begin_anew()
        if self._is_beyond(received, is_first):  # it knows an older sender than this one: go on where that ended
            lost = self._count_lost()
            self._renumber(_after(received))
            return lost
        self._confirm(received)
        return self._count_lost()

    def abandoned(self) -> int:
        """Nobody will come back for what is kept: all that was not confirmed is lost."""
        self._kept.clear()
        self._size_bytes = self._sent = 0
        return self._count_lost()

    # -- inside ------------------------------------------------------------------------------------------------------

    @property
    def _last_sent(self) -> int:
        """The highest number of this connection."""
        first_unsent = self._kept[self._sent].seq if self._sent < len(self._kept) else self._next
        return (first_unsent - 1) & _MASK

    def _is_beyond(self, seq: int, is_first: bool) -> bool:
        """No message of this sender had that number."""
        last = (self._next - 1) & _MASK
        if is_first:
            return _distance(self._confirmed, seq) > _distance(self._confirmed, last)
        return is_newer(seq, last)

    def _is_full(self, size_bytes: int) -> bool:
        limits = self._limits
        most, most_bytes = limits.messages, limits.size_bytes
        if self.is_attached:
            most, most_bytes = most + limits.in_flight_messages, most_bytes + limits.in_flight_bytes
        return self.waiting >= limits.messages or len(self._kept) >= most or self._size_bytes + size_bytes > most_bytes

    def _confirm(self, seq: int) -> None:
        while self._kept and not is_newer(self._kept[0].seq, seq):
            self._drop_first()
        if is_newer(seq, self._confirmed):
            self._confirmed = seq

    def _drop_first(self) -> None:
        self._size_bytes -= self._kept.popleft().size_bytes
        self._sent = max(0, self._sent - 1)

    def _begin_anew(self) -> int:
        while self._kept and self._kept[0].was_sent:
            self._drop_first()
        return self._count_lost()

    def _renumber(self, first: int) -> None:
        for offset, kept in enumerate(self._kept):
            kept.seq = (first + offset) & _MASK
        self._next = (first + len(self._kept)) & _MASK
        self._confirmed = (first - 1) & _MASK

    def _count_lost(self) -> int:
        """Between what is confirmed and what is still kept there is nothing any more."""
        count = _distance(self._confirmed, self.first_seq) - 1
        self._confirmed = (self.first_seq - 1) & _MASK
        self.lost += count
        return count


@dataclass(frozen=True, slots=True)
class Arrival:
    """The verdict on a message that arrived: ``is_new`` unless it came before; ``lost`` messages between the last one
    and it."""

    is_new: bool
    lost: int = 0


class ResumeReceiver:
    """The receiving end. ``received`` is the highest number that has arrived, for the sender; ``None``: it takes
    whatever comes first. ``lost`` counts what will never come."""

    def __init__(self, received: int | None = 0) -> None:
        self.received = received
        self.lost = 0
        self._passed = received
        self._told = received

    def arrived(self, seq: int) -> Arrival:
        """A message of the current connection."""
        if self._passed is not None and not is_newer(seq, self._passed):
            return Arrival(is_new=False)
        missing = 0 if self._passed is None else _distance(self._passed, seq) - 1
        self.received = self._passed = seq
        self.lost += missing
        return Arrival(is_new=True, lost=missing)

    def announced(self, next_seq: int | None) -> int | None:
        """A new connection is up, on which ``next_seq`` comes next. How many are lost; ``None``: the sender has
        forgotten what it sent, so nobody knows."""
        if next_seq is None:
            return None if self.received else 0
        before = (next_seq - 1) & _MASK
        if self._passed is None:
            self.received = self._passed = self._told = before
            return 0
        if not is_newer(before, self._passed):
            return 0
        missing = _distance(self._passed, before)
        self._passed = before  # it has not arrived: the sender has to count it too
        self.lost += missing
        return missing

    def renewed(self) -> None:
        """Somebody new listens, and misses nothing of what was before."""
        self.received = self._passed = self._told = None

    def untold(self) -> int | None:
        """What to tell the sender now: the highest number, once; ``None`` if it knows already."""
        if self.received is None or self.received == self._told:
            return None
        self._told = self.received
        return self.received


_MASK = SEQ_MODULUS - 1


def _after(seq: int) -> int:
    return (seq + 1) & _MASK


def _distance(older: int, newer: int) -> int:
    return (newer - older) & _MASK
