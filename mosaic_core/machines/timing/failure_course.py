"""Decides what the next failure of a handler means: when it is tried again, and whether that is news.

A device that is absent comes back when somebody plugs it in, so it is looked for at short intervals; a mistake in the
code stays, so its pauses grow long.
"""

from __future__ import annotations

from dataclasses import dataclass

from mosaic_core.machines.timing.backoff import Backoff, BackoffPolicy

ERROR_POLICY = BackoffPolicy(first_s=0.5, max_s=30.0)
ABSENCE_POLICY = BackoffPolicy(first_s=1.0, max_s=10.0)


@dataclass(frozen=True, slots=True)
class FailureVerdict:
    """What follows from a failure. ``delay_s``: seconds until the next try. ``is_news``: nobody was told yet that it
    fails for this reason, or it worked for a while since.
    """

    delay_s: float
    is_news: bool


class FailureCourse:
    """The failures of one handler, each an absence of its device or an error."""

    def __init__(self, errors: BackoffPolicy = ERROR_POLICY, absences: BackoffPolicy = ABSENCE_POLICY) -> None:
        self._backoffs = {False: Backoff(errors), True: Backoff(absences)}
        self._steady_s = errors.stable_s
        self._told: tuple[bool, str] | None = None
        self._last: tuple[bool, str] | None = None
        self._is_relapse = False

    @property
    def is_failing(self) -> bool:
        return self._told is not None

    def failed(self, reason: str, *, is_absence: bool, ran_for_s: float, random_unit: float) -> FailureVerdict:
        """``reason``: equal texts are one reason. ``random_unit`` is a random number of [0, 1)."""
        self._backoffs[not is_absence].reset()
        delay_s = self._backoffs[is_absence].failed(ran_for_s, random_unit)
        now = (is_absence, reason)
        is_news, was_relapse = self._told != now, self._is_relapse
        if is_news:
            self._is_relapse = self._last == now and not self.is_failing and ran_for_s < self._steady_s
            is_news = not (self._is_relapse and was_relapse)  # the first one: the log says that it is back
        self._told = self._last = now
        return FailureVerdict(delay_s, is_news)

    def alive(self, works_for_s: float = 0.0) -> bool:
        """It works, for so long without a failure; ``True`` if that is news. After a relapse it is none until it has
        worked for a while: what sends once and fails again each time would fill the log."""
        if self.is_failing:
            self._told = None
            return not self._is_relapse
        is_over = self._is_relapse and works_for_s >= self._steady_s
        self._is_relapse = self._is_relapse and not is_over
        return is_over
