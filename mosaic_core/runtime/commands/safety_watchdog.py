"""The safe actions of all receivers, on a thread of their own with the monotonic clock: a blocked event loop, a hanging
``handle_data`` or another receiver's slow safe action delays none of them.

Leader and followers: one thread waits for the next deadline; before it acts, another one has taken over the waiting.
"""

from __future__ import annotations

import logging
import math
import threading
import time
from collections.abc import Callable, Sequence

from mosaic_core.contract.host import Sender
from mosaic_core.runtime.commands.safety_watch import Action, CommandFence, SafetyWatch
from mosaic_core.runtime.configuration.receiver_safety import ReceiverSafety
from mosaic_core.runtime.threads.thread_priority import run_first
from mosaic_core.words.errors import DeviceGone

logger = logging.getLogger(__name__)

_SPARE_THREADS = 2
_LONGEST_WAIT_S = 3600.0
"""Then look again: a handler may write ``float("inf")`` for never, and no lock waits that long."""


class SafetyWatchdog:
    """Holds all watches of one robot and runs their safe actions in time."""

    def __init__(self) -> None:
        self.changed = threading.Condition()
        self.watches: list[SafetyWatch] = []
        self.fence: CommandFence | None = None
        self._idle = 0
        self._threads = 0
        self.is_closed = False
        self._planned_s = float("inf")

    def guard(
        self,
        label: str,
        safety: ReceiverSafety,
        make_safe: Callable[[str], None],
        peer_left: Callable[[Sender], None],
    ) -> SafetyWatch:
        """Watch one receiver. ``make_safe`` runs on a safety thread, one call at a time; ``peer_left`` too, but safe
        actions don't wait for it."""
        watch = SafetyWatch(self, label, safety, make_safe, peer_left)
        with self.changed:
            self.watches.append(watch)
        return watch

    def start(self) -> None:
        with self.changed:
            for _ in range(_SPARE_THREADS):
                self._spawn()

    def make_all_safe(self, cause: str, patience_s: float) -> bool:
        """Run every safe action and wait for them; ``False`` if one did not end within ``patience_s``. Blocks."""
        return self.make_safe(self.watches, cause, patience_s)

    def make_safe(self, watches: Sequence[SafetyWatch], cause: str, patience_s: float) -> bool:
        """The same for some of them."""
        with self.changed:
            for watch in watches:
                watch.make_safe(cause)
            self.changed.wait_for(lambda: not any(map(_is_busy, watches)), patience_s)
            return not any(watch.is_unsettled for watch in watches)

    def forget(self, watches: Sequence[SafetyWatch]) -> None:
        """Their receivers are gone."""
        with self.changed:
            self.watches = [watch for watch in self.watches if watch not in watches]

    def close(self) -> None:
        """End the threads; actions that are queued still run."""
        with self.changed:
            self.is_closed = True
            self.changed.notify_all()

    def deadline_moved(self, due_s: float | None) -> None:
        """The lock is held. Waking costs a thread switch, so only for a deadline before the planned one."""
        if due_s is not None and due_s < self._planned_s:
            self.changed.notify_all()

    # -- the safety threads --------------------------------------------------------------------------------------

    def _spawn(self) -> None:
        self._threads += 1
        self._idle += 1
        threading.Thread(target=self._serve, name=f"mosaic-safety-{self._threads}", daemon=True).start()

    def _serve(self) -> None:
        run_first()
        with self.changed:
            while True:
                action = self._next_action()
                if action is not None:
                    self._take_over(*action)
                    if self._idle > _SPARE_THREADS:
                        break
                elif self.is_closed:
                    break
                else:
                    self._wait()
            self._idle -= 1

    def _wait(self) -> None:
        due = [due_s for watch in self.watches if (due_s := watch.due_at_s) is not None]
        if self.fence is not None and self.fence.due_at_s is not None:
            due.append(self.fence.due_at_s)
        self._planned_s = min(due, default=float("inf"))
        self.changed.wait(min(max(0.0, self._planned_s - time.monotonic()), _LONGEST_WAIT_S))

    def _next_action(self) -> tuple[SafetyWatch, Action, str] | None:
        """What to do now, with the flag of its watch that says so meanwhile: safe actions before anything else."""
        now_s = time.monotonic()
        if self.fence is not None and not self.is_closed:
            self.fence.expire(now_s)
        for watch in self.watches:
            watch.expire(now_s)
        for watch in self.watches:
            if watch.actions and not watch.is_acting:
                return watch, watch.actions.popleft(), "is_acting"
        for watch in self.watches:
            if watch.farewells and not (watch.is_parting or watch.is_acting):
                return watch, watch.farewells.popleft(), "is_parting"
        return None

    def _take_over(self, watch: SafetyWatch, action: Action, flag: str) -> None:
        """Act with the lock released. Somebody else waits for the next deadline meanwhile."""
        setattr(watch, flag, True)
        self._idle -= 1
        if self._idle == 0:
            self._spawn()
        self.changed.notify_all()
        self.changed.release()
        try:
            _carry_out(watch, action, is_farewell=flag == "is_parting")
        finally:
            self.changed.acquire()
            setattr(watch, flag, False)
            self._idle += 1
            self.changed.notify_all()


def _carry_out(watch: SafetyWatch, action: Action, *, is_farewell: bool) -> None:
    """Whatever a plugin raises here, sys.exit() too, is told: this thread guards all the others."""
    failures, fields = watch.failures, {"label": watch.label}
    try:
        action()
    except BaseException as error:
        if is_farewell:
            logger.exception("peer_left of %r failed", watch.label, extra=fields)
        else:
            _tell_failed(watch, error)
    else:
        if failures and not is_farewell:
            logger.warning(
                "the safe action of %r works again; it had failed %d times", watch.label, failures, extra=fields
            )


def _tell_failed(watch: SafetyWatch, error: BaseException) -> None:
    """The first failure with its traceback, if it is no absence; of those that follow until it works, that they are
    ten, a hundred, …"""
    count, fields = watch.failures, {"label": watch.label}
    if isinstance(error, DeviceGone):
        level = logging.WARNING if count == 1 else logging.DEBUG
        logger.log(level, "the safe action of %r waits for its device: %s", watch.label, error, extra=fields)
    elif count == 1:
        logger.exception("the safe action of %r failed", watch.label, extra=fields)
    elif math.log10(count).is_integer():
        logger.error("the safe action of %r has failed %d times", watch.label, count, extra=fields)


def _is_busy(watch: SafetyWatch) -> bool:
    return watch.is_unsettled or watch.is_parting or bool(watch.farewells)
