"""Measures the quality of the link to one operator: round-trip time, loss of commands, age of the picture it looks at.

Everything is measured by the robot's monotonic clock, and an operator that falls silent only makes it worse.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

from mosaic_core.machines.commands.slow_down import Measures
from mosaic_core.machines.delivery.framing import SEQ_MODULUS, is_newer

MAX_UNANSWERED = 64
MAX_CHANNELS = 64
MAX_PICTURES = 64
LOSS_WINDOW_S = 2.0
LOSS_BINS = 10
MIN_COMMANDS = 10
"""Fewer in the window say nothing about loss: one of three lost would be a third."""
SEEN_BITS = 64
"""A late command fills its gap if it is at most this old; older ones count as lost."""
MAX_GAP = 1024
"""A longer gap is no loss that matters more."""


@dataclass(slots=True)
class _Seen:
    """The commands of one channel: the newest number, and bit ``n`` for the one ``n`` before it."""

    newest: int
    bits: int = 1


@dataclass(slots=True)
class _Bin:
    number: int = -1
    received: int = 0
    lost: int = 0


class LinkQuality:
    """Measures the quality of one peer's link. ``now_s`` is the robot's monotonic clock, of which ``t0_us`` are the
    stamps of its pings."""

    def __init__(self) -> None:
        self._rtt_ms: float | None = None
        self._unanswered_us: deque[int] = deque()
        self._channels: dict[str, _Seen] = {}
        self._bins = [_Bin() for _ in range(LOSS_BINS)]
        self._pictures: dict[str, float] = {}

    def pinged(self, t0_us: int) -> None:
        """A ping left at this time."""
        if len(self._unanswered_us) >= MAX_UNANSWERED:
            self._unanswered_us.pop()  # the oldest says how long it has been silent
        self._unanswered_us.append(t0_us)

    def ponged(self, t0_us: int, now_s: float) -> None:
        """The answer to the ping of ``t0_us``; an answer to none is ignored."""
        if t0_us not in self._unanswered_us:
            return
        while self._unanswered_us.popleft() != t0_us:
            pass  # what was not answered before this one was lost, or comes too late to tell anything new
        self._rtt_ms = max(0.0, now_s * 1000 - t0_us / 1000)

    def command_seen(self, seq: int, now_s: float, channel: str = "") -> None:
        """A command arrived, accepted or not, with the number of its frame."""
        seq %= SEQ_MODULUS
        seen = self._channels.get(channel)
        if seen is None:
            if len(self._channels) < MAX_CHANNELS:
                self._channels[channel] = _Seen(seq)
                self._bin(now_s).received += 1
            return
        if is_newer(seq, seen.newest):
            step = (seq - seen.newest) % SEQ_MODULUS
            seen.newest = seq
            seen.bits = ((seen.bits << step) | 1) & (2**SEEN_BITS - 1) if step < SEEN_BITS else 1
            self._count(now_s, received=1, lost=min(step - 1, MAX_GAP))
            return
        age = (seen.newest - seq) % SEQ_MODULUS
        if age < SEEN_BITS and not seen.bits >> age & 1:
            seen.bits |= 1 << age
            self._count(now_s, received=1, lost=-1)

    def channel_closed(self, channel: str) -> None:
        """Its numbers end; another of the same name starts anew."""
        self._channels.pop(channel, None)

    def picture_seen(self, label: str, capture_s: float | None, now_s: float) -> None:
        """The operator shows a picture captured then; ``None``: it watches, but has seen none yet. The age of its
        pictures counts from now on, and grows until the next report."""
        known = self._pictures.get(label)
        if known is None and len(self._pictures) >= MAX_PICTURES:
            return
        shown_s = (now_s if known is None else known) if capture_s is None else min(capture_s, now_s)
        self._pictures[label] = shown_s if known is None else max(known, shown_s)

    def picture_unwatched(self, label: str) -> None:
        """The operator no longer looks at ``label``, so its age limits nothing."""
        self._pictures.pop(label, None)

    def measures(self, now_s: float) -> Measures:
        return Measures(self._rtt_now_ms(now_s), self._loss(now_s), self._picture_ms(now_s))

    def _rtt_now_ms(self, now_s: float) -> float | None:
        waited_ms = now_s * 1000 - self._unanswered_us[0] / 1000 if self._unanswered_us else None
        if waited_ms is None or self._rtt_ms is None:
            return self._rtt_ms if waited_ms is None else max(0.0, waited_ms)
        return max(self._rtt_ms, waited_ms)

    def _picture_ms(self, now_s: float) -> float | None:
        if not self._pictures:
            return None
        return max(0.0, (now_s - max(self._pictures.values())) * 1000)

    def _loss(self, now_s: float) -> float | None:
        oldest = int(now_s / LOSS_WINDOW_S * LOSS_BINS) - LOSS_BINS
        fresh = [one for one in self._bins if one.number > oldest]
        received, lost = sum(one.received for one in fresh), max(0, sum(one.lost for one in fresh))
        expected = received + lost
        return lost / expected if expected >= MIN_COMMANDS else None

    def _count(self, now_s: float, received: int, lost: int) -> None:
        one = self._bin(now_s)
        one.received += received
        one.lost += lost

    def _bin(self, now_s: float) -> _Bin:
        number = int(now_s / LOSS_WINDOW_S * LOSS_BINS)
        one = self._bins[number % LOSS_BINS]
        if one.number != number:
            one.number, one.received, one.lost = number, 0, 0
        return one
