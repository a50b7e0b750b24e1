"""The one failure policy: an error ends the handler, hooks are told, it restarts with back-off. A device that is gone
is one quiet line, an error names the line of the plugin that raised it; each is logged once when it begins, when its
reason changes, and when it is over.
"""

from __future__ import annotations

import logging
import math
import random
import threading
import time
from collections.abc import Callable

from mosaic_core.machines.timing.backoff import again_in
from mosaic_core.machines.timing.failure_course import FailureCourse
from mosaic_core.runtime.threads.error_words import said_by, words_of
from mosaic_core.runtime.threads.stacks import PluginCode
from mosaic_core.words.errors import DeviceGone, MosaicError

logger = logging.getLogger(__name__)

_TOLD_IN_FULL = "plugin.wrong_message"
"""The code of errors that the framework raises with the author's line: the way to it is the framework's alone."""

TellFailed = Callable[[str, BaseException, float], object]
"""``(label, error, restart_in_s)``; called on the handler's thread."""


def failure_code(error: BaseException) -> str:
    """The ``plugin.*`` code that a plugin gave its error, else the general one."""
    code = error.code if isinstance(error, MosaicError) else ""
    return code if code.startswith("plugin.") else "plugin.failed"


def _away(error: BaseException) -> str:
    """What an author may not know who lets the system's own error pass."""
    if isinstance(error, DeviceGone) or not isinstance(error, OSError):
        return ""
    return "; if its device may be away, raise DeviceGone there: one quiet line, and quick tries"


class Failures:
    """The failures of one handler, and the absences of the device that is kept for it. Any thread."""

    def __init__(
        self,
        label: str,
        tell: TellFailed,
        course: FailureCourse | None = None,
        code: PluginCode | None = None,
    ) -> None:
        self._label = label
        self._tell = tell
        self._course = course or FailureCourse()
        self._code = code or PluginCode(())
        self._lock = threading.Lock()
        self._next_try_at_s = 0.0
        self._works_since_s = 0.0
        self.is_away = False
        """Its kept device is."""
        self.count = 0
        self.last_error = ""
        self.last_code = ""

    @property
    def is_failing(self) -> bool:
        return self._course.is_failing

    @property
    def tries_again_in_s(self) -> float | None:
        """Seconds until the next try; ``None``: it does not fail."""
        return max(0.0, self._next_try_at_s - time.monotonic()) if self.is_failing else None

    def failed(self, error: BaseException, ran_for_s: float) -> float:
        """Note one failure; seconds until the restart."""
        with self._lock:
            return self._note(error, ran_for_s)

    def away(self, gone: DeviceGone, tries_again_in_s: float) -> None:
        """Its device's keeper could not open it, and tries again by itself."""
        with self._lock:
            self.is_away = True
            self._note(gone, math.inf, tries_again_in_s)  # each absence is news: nobody counts how long it was here

    def is_back(self) -> None:
        """Its device's keeper has opened it."""
        with self._lock:
            self.is_away = False
        self.alive()

    def _note(self, error: BaseException, ran_for_s: float, delay_s: float | None = None) -> float:
        """``delay_s``: where somebody else decides."""
        is_absence = isinstance(error, DeviceGone)
        place = self._code.place_of(error)
        reason = words_of(error) if is_absence else f"{type(error).__name__} at {place}"
        verdict = self._course.failed(reason, is_absence=is_absence, ran_for_s=ran_for_s, random_unit=random.random())
        delay_s = verdict.delay_s if delay_s is None else delay_s
        self._next_try_at_s = time.monotonic() + delay_s
        self.last_code = failure_code(error)
        self.last_error = words_of(error) if is_absence else said_by(error)
        self.count += 1
        level = logging.DEBUG if not verdict.is_news else logging.WARNING if is_absence else logging.ERROR
        what = "" if is_absence else f" failed at {place}" if place else " failed"
        trace = None if is_absence or not verdict.is_news or self.last_code == _TOLD_IN_FULL else error
        told = (self._label, what, self.last_error + _away(error), self.last_code, again_in(delay_s))
        fields = {"label": self._label, "code": self.last_code}
        logger.log(level, "connector %r%s: %s (%s); tries again %s", *told, extra=fields, exc_info=trace)
        self._tell(self._label, error, delay_s)
        return delay_s

    def noted(self, error: BaseException, code: str) -> str:
        """One failure that ends nothing; where it is in the plugin's code, or nothing."""
        self.last_code = code
        self.count += 1
        self.last_error = said_by(error)
        return self._code.place_of(error)

    def alive(self) -> None:
        """It produced or took something: it works (again), but for a kept device, of which its keeper tells."""
        if self.is_away:
            return
        now_s = time.monotonic()
        if self.is_failing:
            self._works_since_s = now_s
        if self._course.alive(now_s - self._works_since_s):
            # as loud as its absence, so that no log ends with that
            logger.warning("connector %r is back", self._label, extra={"label": self._label})
