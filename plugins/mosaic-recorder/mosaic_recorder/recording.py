"""The base of what one recorder records at a time: a thread of its own, until somebody stops it or a limit does."""

from __future__ import annotations

import logging
import threading
from abc import ABC, abstractmethod
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Any, Generic, Literal, TypeVar

from mosaic_recorder.disk_watch import code_of
from mosaic_recorder.messages import RecordingState, RecordingStatus

logger = logging.getLogger(__name__)

WAKE_S = 0.2
"""How long a picture or a message is waited for before commands are looked at."""

Wish = Literal["record", "pause", "stop"]


@dataclass(frozen=True, slots=True)
class Limits:
    """The limits at which a recording ends by itself. ``key_interval_s`` 0: no key frame is asked for."""

    max_seconds: float | None = None
    max_bytes: int | None = None
    key_interval_s: float = 0.0


T = TypeVar("T", bound=AbstractContextManager[Any])
"""The tap that it reads."""


class Recording(ABC, Generic[T]):
    """Records what a tap gives. Commands and :meth:`status` from any thread, none of them waits; ``changed`` is called
    on the recording's own.

    ``check_disk`` is called now and then and says why the disk takes no more, or nothing.
    """

    def __init__(
        self,
        label: str,
        open_tap: Callable[[], T],
        limits: Limits,
        *,
        changed: Callable[[], None] = lambda: None,
        check_disk: Callable[[], str] = lambda: "",
    ) -> None:
        self.label = label
        self._open_tap = open_tap
        self._limits = limits
        self._changed = changed
        self._check_disk = check_disk
        self._wishes = threading.Condition()
        self._wish: Wish = "record"
        self._state: RecordingState = "starting"
        self._code = ""
        self._dropped = self._dropped_before = 0
        self._thread = threading.Thread(target=self.run, name=f"mosaic-recording-{label}", daemon=True)

    # -- any thread ----------------------------------------------------------------------------------------------

    def start(self) -> None:
        self._thread.start()

    def wish(self, wish: Wish) -> None:
        """From now on; a recording that was stopped stays so."""
        with self._wishes:
            if self._wish != "stop":
                self._wish = wish
                self._wishes.notify_all()

    @property
    def wanted(self) -> Wish:
        return self._wish

    @property
    def is_running(self) -> bool:
        """It records, waits or pauses, and nobody stopped it."""
        return self._wish != "stop" and self._state != "ended"

    @property
    def has_ended(self) -> bool:
        return self._state == "ended"

    def join(self, timeout_s: float) -> bool:
        """Wait for the end of a stopped recording; whether it came."""
        if self._thread.ident is not None:
            self._thread.join(timeout_s)
        return not self._thread.is_alive()

    @abstractmethod
    def status(self) -> RecordingStatus: ...

    # -- its own thread ------------------------------------------------------------------------------------------

    @abstractmethod
    def _record(self, tap: T) -> str:
        """Until another wish, or a reason to end, which comes back."""

    @abstractmethod
    def _cut(self) -> None:
        """Nothing comes for a while."""

    @abstractmethod
    def _close(self) -> None:
        """Finish the files. Raises :class:`OSError`."""

    def run(self) -> None:
        """All of it. Raises nothing: the robot goes on whatever the disk does."""
        code = ""
        try:
            code = self._live()
        except OSError as error:
            code = code_of(error)
            logger.warning("recording of %r ended: %s (%s)", self.label, error, code)
        except Exception:
            code = "recorder.failed"
            logger.exception("recording of %r ended", self.label)
        self._end(code)

    def _end(self, code: str) -> None:
        try:
            self._close()
        except OSError as error:
            code = code or code_of(error)
            logger.warning("the file of %r could not be finished: %s; it is whole up to there", self.label, error)
        self._code = code
        self._enter("ended")

    def _live(self) -> str:
        while self._wish != "stop":
            with self._open_tap() as tap:
                self._enter("starting")
                self._dropped_before = self._dropped
                code = self._record(tap)
            if code:
                return code
            self._cut()
            self._rest()
        return ""

    def _rest(self) -> None:
        """Sleep through a pause; whatever is recorded may, too."""
        if self._wish == "pause":
            self._enter("paused")
        with self._wishes:
            self._wishes.wait_for(lambda: self._wish != "pause")

    def _enter(self, state: RecordingState) -> None:
        if state != self._state:
            self._state = state
            self._changed()
