"""The safe actions of all receivers, on a thread of their own with the monotonic clock: a blocked event loop, a hanging
``handle_data`` or another receiver's slow safe action delays none of them.

Leader and followers: one thread waits for the next deadline; before it acts, another one has taken over the waiting.
"""

from __future__ import annotations

import logging
import threading
import time
from collections import deque
from collections.abc import Callable

from mosaic_core.contract.host import Sender
from mosaic_core.machines.watchdog import Feeding, Watchdog

logger = logging.getLogger(__name__)

_SPARE_THREADS = 2
_LONGEST_WAIT_S = 3600.0
"""Then look again: a handler may write ``float("inf")`` for never, and no lock waits that long."""
_RETRY_S = (0.05, 0.1, 0.2, 0.5, 1.0)
"""Waits after a safe action that raised; the last one repeats until it works or a newer command is carried out."""
_Action = Callable[[], None]


class SafetyWatch:
    """One receiver under watch. Methods may be called from any thread; none blocks on a safe action."""

    def __init__(
        self,
        owner: SafetyWatchdog,
        label: str,
        timeout_s: float | None,
        make_safe: Callable[[str], None],
        peer_left: Callable[[Sender], None],
    ) -> None:
        self._owner = owner
        self.label = label
        self.watchdog = Watchdog(timeout_s)
        self._make_safe = make_safe
        self._peer_left = peer_left
        self._present: set[str] = set()
        self._handling: str | None = None
        self._overtaken_cause: str | None = None
        self._before: Feeding | None = None
        self.actions: deque[_Action] = deque()
        self.is_acting = False
        self.fired = 0
        self._failures = 0
        self._retry: tuple[float, str] | None = None

    @property
    def due_at_s(self) -> float | None:
        """When :meth:`expire` has something to do next."""
        due = [due_s for due_s in (self.watchdog.due_at_s, self._retry and self._retry[0]) if due_s is not None]
        return min(due, default=None)

    @property
    def is_unsettled(self) -> bool:
        """An action runs, waits, or failed and will be repeated."""
        return self.is_acting or bool(self.actions) or self._retry is not None

    def begin(self, peer_id: str) -> bool:
        """A valid command is about to act: feeds the watchdog. ``False``: its sender is gone, it must not act."""
        with self._owner.changed:
            if peer_id not in self._present:
                return False
            self._before = self.watchdog.feed(peer_id, time.monotonic())
            self._handling, self._overtaken_cause = peer_id, None
            self._owner.deadline_moved(self.watchdog.due_at_s)
            return True

    def finish(self, *, accepted: bool, failed: bool = False) -> None:
        """``handle_data`` is done. If the safe action ran meanwhile, the command may have undone it: run it again.

        ``failed``: it did not refuse the command but broke while it carried it out; what it set going must still stop.
        """
        with self._owner.changed:
            self._handling = None
            if not accepted and self._before is not None:
                if failed:
                    self.watchdog.keep_deadline(self._before)
                else:
                    self._unfeed(self._before)
                self._owner.deadline_moved(self.watchdog.due_at_s)
            cause, self._overtaken_cause = self._overtaken_cause, None
            if cause is not None and not self._owner.is_closed:
                self._act(cause)
            elif accepted:
                self._retry = None
        if cause is not None and self._owner.is_closed:  # an abandoned body came back after the robot had stopped
            self._make_safe(cause)

    def _unfeed(self, before: Feeding) -> None:
        """Whoever commanded before may have left while the refused command hid it."""
        self.watchdog.unfeed(before)
        commander = before[1]
        if commander is not None and commander not in self._present and self.watchdog.peer_left(commander):
            self._act("safety.peer_left")

    def peer_joined(self, peer_id: str) -> None:
        """Commands of this peer may act until it leaves."""
        with self._owner.changed:
            self._present.add(peer_id)

    def peer_left(self, sender: Sender) -> None:
        """A peer that had the channel open is gone: stop what it commanded, tell the handler."""
        with self._owner.changed:
            self._present.discard(sender.peer_id)
            is_handling = self._handling == sender.peer_id
            if self.watchdog.peer_left(sender.peer_id) or is_handling:
                self._act("safety.peer_left")
            self.actions.append(lambda: self._peer_left(sender))
            self._owner.changed.notify_all()

    def make_safe(self, cause: str) -> None:
        """Run the safe action now."""
        with self._owner.changed:
            self.watchdog.disarm()
            self._act(cause)

    def expire(self, now_s: float) -> None:
        """The safety thread looks whether the time is over. The lock is held."""
        if self.watchdog.expire(now_s):
            self._act("safety.timeout")
        elif self._retry is not None and now_s >= self._retry[0]:
            self._act(self._retry[1])

    def _run(self, cause: str) -> None:
        """The safety thread. One failed write must not leave it moving."""
        try:
            self._make_safe(cause)
        except BaseException:
            with self._owner.changed:
                wait_s = _RETRY_S[min(self._failures, len(_RETRY_S) - 1)]
                self._failures += 1
                self._retry = (time.monotonic() + wait_s, cause)
            raise
        with self._owner.changed:
            self._failures, self._retry = 0, None

    def _act(self, cause: str) -> None:
        self.fired += 1
        self._retry = None
        if self._handling is not None:
            self._overtaken_cause = cause
        self.actions.append(lambda: self._run(cause))
        self._owner.changed.notify_all()


class SafetyWatchdog:
    """All watches of one robot."""

    def __init__(self) -> None:
        self.changed = threading.Condition()
        self._watches: list[SafetyWatch] = []
        self._idle = 0
        self._threads = 0
        self.is_closed = False
        self._planned_s = float("inf")

    def guard(
        self,
        label: str,
        timeout_s: float | None,
        make_safe: Callable[[str], None],
        peer_left: Callable[[Sender], None],
    ) -> SafetyWatch:
        """Watch one receiver. ``make_safe`` and ``peer_left`` run on a safety thread, one at a time per receiver."""
        watch = SafetyWatch(self, label, timeout_s, make_safe, peer_left)
        with self.changed:
            self._watches.append(watch)
        return watch

    def start(self) -> None:
        with self.changed:
            for _ in range(_SPARE_THREADS):
                self._spawn()

    def make_all_safe(self, cause: str, patience_s: float) -> bool:
        """Run every safe action and wait for them; ``False`` if one did not end within ``patience_s``. Blocks."""
        with self.changed:
            for watch in self._watches:
                watch.make_safe(cause)
            return self.changed.wait_for(lambda: not any(watch.is_unsettled for watch in self._watches), patience_s)

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
        with self.changed:
            while True:
                watch = self._next_watch()
                if watch is not None:
                    self._take_over(watch)
                    if self._idle > _SPARE_THREADS:
                        break
                elif self.is_closed:
                    break
                else:
                    self._wait()
            self._idle -= 1

    def _wait(self) -> None:
        due = [due_s for watch in self._watches if (due_s := watch.due_at_s) is not None]
        self._planned_s = min(due, default=float("inf"))
        self.changed.wait(min(max(0.0, self._planned_s - time.monotonic()), _LONGEST_WAIT_S))

    def _next_watch(self) -> SafetyWatch | None:
        now_s = time.monotonic()
        for watch in self._watches:
            watch.expire(now_s)
        return next((watch for watch in self._watches if watch.actions and not watch.is_acting), None)

    def _take_over(self, watch: SafetyWatch) -> None:
        """Act with the lock released. Somebody else waits for the next deadline meanwhile."""
        action = watch.actions.popleft()
        watch.is_acting = True
        self._idle -= 1
        if self._idle == 0:
            self._spawn()
        self.changed.notify_all()
        self.changed.release()
        try:
            action()
        except BaseException:  # whatever a plugin raises here, sys.exit() too: this thread guards all the others
            logger.exception("the safe action of %r failed", watch.label, extra={"label": watch.label})
        finally:
            self.changed.acquire()
            watch.is_acting = False
            self._idle += 1
            self.changed.notify_all()
