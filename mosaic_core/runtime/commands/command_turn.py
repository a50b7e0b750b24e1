"""Takes one command through the gates of its turn (``machines/commands/admission.py``): what they ask about it is asked
here, of its shaper, its link and its watch.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from mosaic_core.machines.commands.admission import CommandTerms
from mosaic_core.machines.commands.slow_down import Measures
from mosaic_core.runtime.commands.command_shaper import CommandShaper, ShapedCommand


class CommandTurn:
    """A command whose turn has come; implements ``Acting``. On the receiver's one thread or task."""

    def __init__(
        self,
        payload: bytes,
        shaper: CommandShaper,
        terms: CommandTerms,
        measure: Callable[[], Measures],
        begin: Callable[[ShapedCommand], str | None],
        *,
        must_release: Callable[[], bool] = lambda: False,
        waited_s: float = 0.0,
        max_age_s: float | None = None,
        rest_code: str | None = None,
    ) -> None:
        """``begin`` lets a shaped command act; the code why it must not. ``must_release``: its sender has not let go
        since the last stop."""
        self.terms = terms
        self.waited_s = waited_s
        self.max_age_s = max_age_s
        self.rest_code = rest_code
        self.factor = 1.0
        self.measured = Measures()
        self.measure = measure
        self._payload = payload
        self._shaper = shaper
        self._begin = begin
        self._must_release = must_release
        self._value: Any = None
        self._shaped: ShapedCommand | None = None

    @property
    def command(self) -> ShapedCommand:
        """What may act, once every gate has been passed."""
        assert self._shaped is not None
        return self._shaped

    def parse(self) -> None:
        self._value = self._shaper.parsed(self._payload)

    def limit(self) -> None:
        self._shaped = self._shaper.limited(self._value, self.factor)

    def is_let_go(self) -> bool:
        if not (self.command.wants_motion and self._must_release()):
            return True
        self._shaper.undone()
        return False

    def begin(self) -> str | None:
        code = self._begin(self.command)
        if code is not None:
            self._shaper.undone()
        return code
