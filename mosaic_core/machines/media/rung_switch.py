"""Which encoded pictures one viewer is sent: whole runs from a key frame on, of one rung at a time, never back in
time.

Pictures build on those before them, so a viewer enters a rung at a key frame only. Until the new rung has one, the old
rung's pictures go on: a switch is never seen as a gap. An encoder may be behind another one: the pictures of its run
that were captured before what the viewer has seen wait, and are sent with the first one that is not.
"""

from __future__ import annotations

from collections.abc import Hashable
from typing import Generic, TypeVar

R = TypeVar("R", bound=Hashable)
P = TypeVar("P")

MAX_HELD = 6
"""Pictures of a new rung that wait until it has caught up, a fifth of a second: then a step back is the lesser evil."""


class RungSwitch(Generic[R, P]):
    """Switches one viewer between rungs at key frames. ``current``: whose pictures it gets; ``wanted``: whose it shall
    get.
    """

    def __init__(self) -> None:
        self.current: R | None = None
        self.wanted: R | None = None
        self._is_torn = True
        self._held: list[P] = []
        self._seen_at: int | None = None

    @property
    def needs_key(self) -> R | None:
        """The rung whose next key frame this viewer waits for."""
        return self.wanted if self._is_torn or self.current != self.wanted else None

    @property
    def used(self) -> tuple[R, ...]:
        """The rungs that must be encoded for this viewer."""
        both = dict.fromkeys((self.current, self.wanted))
        return tuple(rung for rung in both if rung is not None)

    def want(self, rung: R | None) -> None:
        """Move to ``rung`` at its next key frame; ``None``: the viewer looks away."""
        self.wanted = rung
        if rung is None:
            self.current = self._seen_at = None
            self.tear()

    def tear(self) -> None:
        """A picture was left out: nothing can be shown before the next key frame."""
        self._is_torn = True
        self._held = []

    def taken(self, rung: R, picture: P, *, is_key: bool, captured_at: int) -> list[P]:
        """The pictures that the viewer is sent now that ``rung`` has this one; ``captured_at`` on any clock."""
        if is_key and rung in (self.wanted, self.current):
            if rung == self.wanted:
                self.current = rung
            self._is_torn = False
            self._held = []  # a key frame needs none of those before it
        if rung != self.current or self._is_torn:
            return []
        self._held.append(picture)
        if self._seen_at is not None and captured_at < self._seen_at and len(self._held) < MAX_HELD:
            return []
        taken, self._held, self._seen_at = self._held, [], captured_at
        return taken
