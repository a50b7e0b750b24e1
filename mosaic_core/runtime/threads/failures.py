"""The one failure policy: an error ends the handler, hooks are told, it restarts with back-off; logged once when lost
and once when back.
"""

from __future__ import annotations

import logging
import random
from collections.abc import Callable

from mosaic_core.machines.timing.backoff import Backoff, BackoffPolicy
from mosaic_core.words.errors import MosaicError

logger = logging.getLogger(__name__)

RESTART_POLICY = BackoffPolicy(first_s=0.5, max_s=30.0)
TellFailed = Callable[[str, BaseException, float], object]
"""``(label, error, restart_in_s)``; called on the handler's thread."""


def failure_code(error: BaseException) -> str:
    """The ``plugin.*`` code that a plugin gave its error, else the general one."""
    code = error.code if isinstance(error, MosaicError) else ""
    return code if code.startswith("plugin.") else "plugin.failed"


class Failures:
    """The failures of one handler; used by the one thread or task that runs it."""

    def __init__(self, label: str, tell: TellFailed, policy: BackoffPolicy = RESTART_POLICY) -> None:
        self._label = label
        self._tell = tell
        self._backoff = Backoff(policy)
        self.is_failing = False
        self.count = 0
        self.last_error = ""
        self.last_code = ""

    def failed(self, error: BaseException, ran_for_s: float) -> float:
        """Note one failure; seconds until the restart."""
        delay_s = self._backoff.failed(ran_for_s, random.random())
        self.last_code = code = failure_code(error)
        fields = {"label": self._label, "code": code}
        text = f"connector %r failed: %s: %s ({code}); next try in %.1f s"
        level = logging.DEBUG if self.is_failing else logging.ERROR
        cause = (self._label, type(error).__name__, error, delay_s)
        logger.log(level, text, *cause, extra=fields, exc_info=error if not self.is_failing else None)
        self.is_failing = True
        self.count += 1
        self.last_error = f"{type(error).__name__}: {error}"
        self._tell(self._label, error, delay_s)
        return delay_s

    def alive(self) -> None:
        """It produced or took something: it works (again)."""
        if self.is_failing:
            self.is_failing = False
            logger.info("connector %r is back", self._label, extra={"label": self._label})
