"""Buffers one talker's sound between the network and the loudspeaker: a short wait evens out its jitter, what is
missing is silence, what comes too late is dropped, and what piles up is skipped, so that latency never accumulates.

Positions and lengths are counted in samples of the talker's clock.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic, TypeVar

T = TypeVar("T")

RATE_HZ = 48_000
STEP = RATE_HZ // 50
"""20 ms: what Opus senders put into a packet."""
DELAY = 2 * STEP
"""What waits before the first sound is played: jitter up to 40 ms is not heard."""
MAX_WAITING = 10 * STEP
"""200 ms: beyond that the oldest is skipped until :data:`DELAY` is left."""
MAX_GAP = 5 * STEP
"""A longer one is a pause of the talker, which nobody wants to wait through."""
IDLE_STEPS = 25
"""Half a second without anything: the talk is over."""


@dataclass(frozen=True, slots=True)
class Play(Generic[T]):
    """Play this."""

    item: T
    length: int


@dataclass(frozen=True, slots=True)
class PlaySilence:
    """Something is missing or late: play so many samples of silence."""

    length: int = STEP


@dataclass(frozen=True, slots=True)
class TalkOver:
    """The talk is over: nothing more has come."""


class Playout(Generic[T]):
    """The machine. The driver calls :meth:`take` when the last step has been played, and first every step."""

    def __init__(self) -> None:
        self._waiting: dict[int, tuple[int, T]] = {}
        self._next: int | None = None
        self._idle_steps = 0
        self.late = 0
        """Pieces that came after their turn."""
        self.skipped = 0
        """Pieces that were skipped because too much waited."""

    @property
    def waiting(self) -> int:
        """Samples that wait."""
        return sum(length for length, _ in self._waiting.values())

    @property
    def is_idle(self) -> bool:
        """Nothing waits and nothing plays: :meth:`take` has nothing to do."""
        return self._next is None and not self._waiting

    def put(self, position: int, length: int, item: T) -> bool:
        """A piece has arrived; ``False`` if it is too late, or there already."""
        if self._next is not None and position < self._next - RATE_HZ:
            self.clear()  # the talker's clock has begun anew
        if position in self._waiting or (self._next is not None and position < self._next):
            self.late += 1
            return False
        self._waiting[position] = (length, item)
        if self.waiting > MAX_WAITING:
            self._skip()
        return position in self._waiting

    def take(self) -> Play[T] | PlaySilence | TalkOver | None:
        """What to play for the next step; ``None`` while the first sounds still wait."""
        if not self._waiting:
            return self._starved()
        if self._next is None and self.waiting < DELAY and self._idle_steps * STEP < DELAY:
            self._idle_steps += 1  # a word that is shorter than the delay is played all the same
            return None
        self._idle_steps = 0
        first = min(self._waiting)
        if self._next is not None and 0 < first - self._next <= MAX_GAP:
            gap = min(STEP, first - self._next)
            self._next += gap
            return PlaySilence(gap)
        length, item = self._waiting.pop(first)
        self._next = first + length
        return Play(item, length)

    def clear(self) -> None:
        """Fall silent at once."""
        self._waiting.clear()
        self._next = None
        self._idle_steps = 0

    def _starved(self) -> PlaySilence | TalkOver | None:
        """The talker is late or has ended. Its next piece keeps its turn: the delay grows by what its jitter needs."""
        if self._next is None:
            return None
        self._idle_steps += 1
        if self._idle_steps < IDLE_STEPS:
            return PlaySilence()
        self.clear()
        return TalkOver()

    def _skip(self) -> None:
        while self.waiting > DELAY and len(self._waiting) > 1:
            first = min(self._waiting)
            length, _ = self._waiting.pop(first)
            self._next = first + length
            self.skipped += 1
