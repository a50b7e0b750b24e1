"""Which encoded pictures one viewer is sent: whole runs from a key frame on, of one rung at a time.

Pictures build on those before them, so a viewer enters a rung at a key frame only. Until the new rung has one, the old
rung's pictures go on: a switch is never seen as a gap.
"""

from __future__ import annotations

from collections.abc import Hashable
from typing import Generic, TypeVar

R = TypeVar("R", bound=Hashable)


class RungSwitch(Generic[R]):
    """Switches one viewer between rungs at key frames. ``current``: whose pictures it gets; ``wanted``: whose it shall
    get.
    """

    def __init__(self) -> None:
        self.current: R | None = None
        self.wanted: R | None = None
        self._is_torn = True

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
            self.current = None
            self._is_torn = True

    def tear(self) -> None:
        """A picture was left out: nothing can be shown before the next key frame."""
        self._is_torn = True

    def takes(self, rung: R, is_key: bool) -> bool:
        """Whether the viewer is sent this picture."""
        if is_key and rung == self.wanted:
            self.current = rung
            self._is_torn = False
            return True
        if is_key and rung == self.current:
            self._is_torn = False
        return rung == self.current and not self._is_torn
