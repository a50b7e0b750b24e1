"""Watches one receiver for safety: which command may act, who is moving it, and when its safe action must run."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable
from typing import Protocol

from mosaic_core.contract.host import Sender
from mosaic_core.machines.commands.admission import OVERTAKEN
from mosaic_core.machines.commands.release_first import ReleaseFirst
from mosaic_core.machines.commands.watchdog import Feeding, Watchdog
from mosaic_core.runtime.commands.inbox import Incoming
from mosaic_core.runtime.configuration.receiver_safety import ReceiverSafety
from mosaic_core.words.safety_config import SafePolicy

_RETRY_S = (0.05, 0.1, 0.2, 0.5, 1.0)
"""Waits after a safe action that raised; the last one repeats until it works or a newer command is carried out."""
ZEROS_FOR_S = 1.0
"""How long the policy ``zero`` repeats zeros: long enough for any controller, short enough for the next driver."""
RESTOP_S = 0.05
"""While a command that a safe action overtook still hangs in the plugin, the safe action runs this often: twice per
period of the slowest usual motor controller (10 Hz)."""
GONE = "gone"
"""Its sender has left, or opened the channel anew since: it must not act, and nobody is there to be told."""
_FRAMEWORK = ""
"""Who acts when the framework sends zeros."""
MAX_FAREWELLS = 256
"""A plugin's ``peer_left`` that hangs while somebody opens and closes the channel for ever must not fill our memory."""
Action = Callable[[], None]


class CommandFence(Protocol):
    """Says who may command now. The lock is held at every call."""

    @property
    def due_at_s(self) -> float | None:
        """When :meth:`expire` has something to do next."""

    @property
    def is_stopped(self) -> bool: ...
    def refusal(
        self, safety: ReceiverSafety, peer_id: str, epoch: int | None, now_s: float | None = None
    ) -> str | None: ...
    def commanded(self, safety: ReceiverSafety, peer_id: str, now_s: float) -> None: ...
    def made_safe(self, watch: SafetyWatch) -> None: ...
    def expire(self, now_s: float) -> None: ...


def _session_of(sender: Sender) -> str:
    return sender.session_id or sender.peer_id


class WatchOwner(Protocol):
    """Holds the lock of all watches and runs their safe actions."""

    changed: threading.Condition
    fence: CommandFence | None
    is_closed: bool

    def deadline_moved(self, due_s: float | None) -> None: ...


class SafetyWatch:
    """Watches one receiver: lets its commands act, and has its safe action run in time.

    A safe action overtakes a command: one that begins to act before and returns after it may have undone it. So the
    safe action runs again when ``handle_data`` returns, and every :data:`RESTOP_S` while it hangs.

    Methods may be called from any thread; none blocks on a safe action. What has no docstring line about the lock
    takes it.
    """

    def __init__(
        self,
        owner: WatchOwner,
        label: str,
        safety: ReceiverSafety,
        make_safe: Callable[[str], None],
        peer_left: Callable[[Sender], None],
    ) -> None:
        self._owner = owner
        self.label = label
        self.safety = safety
        self.watchdog = Watchdog(safety.timeout_s)
        self._make_safe = make_safe
        self._peer_left = peer_left
        self.dropped: Callable[[str | None], object] = lambda peer_id: None
        """Set by the receiver: forget what this peer (``None``: everybody) has queued."""
        self.woken: Callable[[], object] = lambda: None
        """Set by the receiver: :meth:`begin_zero` has something to do."""
        self.generation = 0
        """Raised by every stop and loss of the lease; a command is stamped with it on arrival."""
        self.mover: str | None = None
        """The peer whose commands may still be moving it."""
        self.fired = 0
        self.actions: deque[Action] = deque()
        self.farewells: deque[Action] = deque()
        self.is_acting = False
        self.is_parting = False
        self._openings: dict[str, int] = {}
        self._sessions: dict[str, str] = {}
        """By peer: the session that a stop remembers, or the peer itself where it has none."""
        self._release = ReleaseFirst()
        self._commander = ""
        self._opened = 0
        self._fenced_by = "safety.stopped"
        self._handling: str | None = None
        self._overtaken_cause: str | None = None
        self._restop_at_s: float | None = None
        self._before: tuple[Feeding, str | None, int] | None = None
        self._zeros: tuple[int, float] | None = None
        self.failures = 0
        """How often the safe action has failed since it worked last."""
        self._retry: tuple[float, str, bool] | None = None

    @property
    def due_at_s(self) -> float | None:
        """When :meth:`expire` has something to do next."""
        due = (self.watchdog.due_at_s, self._retry and self._retry[0], self._restop_at_s)
        return min((due_s for due_s in due if due_s is not None), default=None)

    @property
    def is_unsettled(self) -> bool:
        """A safe action runs, waits, or failed and will be repeated."""
        return self.is_acting or bool(self.actions) or self._retry is not None

    # -- commands ------------------------------------------------------------------------------------------------

    def must_release(self, item: Incoming) -> bool:
        """Its sender went on sending through a stop, and has not let go since. Of an item of before a stop
        :meth:`begin` says so."""
        return self._release.is_holding(_session_of(item.sender))

    def paused(self, item: Incoming) -> None:
        """Its sender had sent nothing for as long as the time-out, and no stop is in force."""
        with self._owner.changed:
            if item.generation == self.generation:
                self._release.let_go(_session_of(item.sender))

    def begin(
        self, item: Incoming, *, fired: int | None = None, is_idle: bool = False, wants_motion: bool = True
    ) -> str | None:
        """A valid command is about to act: feeds the watchdog. Otherwise the code why it must not act (or
        :data:`GONE`, :data:`OVERTAKEN`). ``fired``: of when it was shaped. ``is_idle``: it only says that the receiver
        stands, so nothing acts and nothing needs watching. Without ``wants_motion`` its sender has let go."""
        with self._owner.changed:
            peer_id = item.sender.peer_id
            now_s = time.monotonic()
            refusal = self._refusal(item, now_s)
            if refusal is not None:
                return refusal
            if fired is not None and fired != self.fired:
                return OVERTAKEN
            if self._owner.fence is not None:
                self._owner.fence.commanded(self.safety, peer_id, now_s)
            self._commander = _session_of(item.sender)
            if not wants_motion:
                self._release.let_go(self._commander)
            self._zeros = None
            if is_idle:
                self.watchdog.disarm()
                self.mover = None
                return None
            self._before = (self.watchdog.feed(peer_id, time.monotonic()), self.mover, self.fired)
            self.mover = self._handling = peer_id
            self._owner.deadline_moved(self.watchdog.due_at_s)
            return None

    def _refusal(self, item: Incoming, now_s: float) -> str | None:
        if self._openings.get(item.sender.peer_id) != item.opening:
            return GONE
        fence = self._owner.fence
        refusal = fence.refusal(self.safety, item.sender.peer_id, item.epoch, now_s) if fence is not None else None
        if refusal is None and item.generation != self.generation:
            return self._fenced_by
        return refusal

    def begin_zero(self) -> bool:
        """May the framework's zeros act now? Call :meth:`finish` after them."""
        with self._owner.changed:
            if self.zeros_until_s is None:
                return False
            self._handling, self._before = _FRAMEWORK, None
            return True

    def no_zeros(self) -> None:
        """The receiver can make no zero of its last command."""
        with self._owner.changed:
            self._zeros = None

    @property
    def zeros_until_s(self) -> float | None:
        """Until when the framework shall send zeros; ``None``: not at all."""
        zeros = self._zeros
        return zeros[1] if zeros and zeros[0] == self.fired and time.monotonic() < zeros[1] else None

    def finish(self, *, accepted: bool, failed: bool = False) -> str | None:
        """``handle_data`` is done. If the safe action ran meanwhile, the command may have undone it: run it again; the
        answer is then its cause.

        ``failed``: it did not refuse the command but broke while it carried it out; what it set going must still stop.
        """
        with self._owner.changed:
            self._handling = None
            if not accepted and self._before is not None:
                if failed:
                    self.watchdog.keep_deadline(self._before[0])
                else:
                    self._unfeed(*self._before)
                self._owner.deadline_moved(self.watchdog.due_at_s)
            cause, self._overtaken_cause, self._restop_at_s = self._overtaken_cause, None, None
            if cause is not None and not self._owner.is_closed:
                self._act(cause)
            elif accepted:
                self._retry = None
        if cause is not None and self._owner.is_closed:  # an abandoned body came back after the robot had stopped
            self._make_safe(cause)
        return cause

    def _unfeed(self, before: Feeding, mover: str | None, fired: int) -> None:
        """Whoever commanded before may have left while the refused command hid it."""
        self.watchdog.unfeed(before)
        if fired != self.fired:
            return
        self.mover = mover
        if mover is not None and mover not in self._openings:
            self._lost()

    # -- peers ---------------------------------------------------------------------------------------------------

    def peer_joined(self, peer_id: str, session_id: str = "") -> int:
        """Commands of this peer may act until it leaves; the number that they must carry as ``opening``."""
        with self._owner.changed:
            self._opened += 1
            self._openings[peer_id] = self._opened
            self._sessions[peer_id] = session_id or peer_id
            if self.safety.is_motion and self._owner.fence is not None and self._owner.fence.is_stopped:
                self._release.joined(self._sessions[peer_id])
            return self._opened

    def peer_left(self, sender: Sender) -> None:
        """A peer that had the channel open is gone: stop what it commanded, tell the handler."""
        with self._owner.changed:
            self._openings.pop(sender.peer_id, None)
            self._sessions.pop(sender.peer_id, None)
            if sender.peer_id in (self.mover, self._handling):
                self._lost()
            if len(self.farewells) < MAX_FAREWELLS:
                self.farewells.append(lambda: self._peer_left(sender))
            self._owner.changed.notify_all()

    def lease_lost(self, peer_id: str) -> None:
        """What this peer has queued must not act, what it moves must stop. The lock is held."""
        self._fence("lease.old_epoch", peer_id)
        if peer_id in (self.mover, self._handling):
            self._act("safety.lease_lost")

    def device_changed(self) -> None:
        """The device that it moves has gone or is back: whoever holds a stick meanwhile moves nothing by that alone,
        for whoever plugs it in stands beside it."""
        with self._owner.changed:
            self._must_let_go()

    def _must_let_go(self) -> None:
        self._release.stopped({*self._sessions.values(), self._commander})

    def stop(self) -> None:
        """Nothing that has arrived until now may act, whatever moves must stand. The lock is held."""
        self._must_let_go()
        self._fence("safety.stopped", None)
        self._act("safety.stop")

    def _fence(self, code: str, peer_id: str | None) -> None:
        self.generation += 1
        self._fenced_by = code
        self.dropped(peer_id)

    # -- safe actions --------------------------------------------------------------------------------------------

    def make_safe(self, cause: str) -> None:
        with self._owner.changed:
            self._act(cause)

    def expire(self, now_s: float) -> None:
        """The safety thread looks whether the time is over. The lock is held."""
        if self.watchdog.expire(now_s):
            self._follow(self.safety.on_timeout, "safety.timeout")
        elif self._retry is not None and now_s >= self._retry[0]:
            _, cause, with_zeros = self._retry
            self._act(cause, with_zeros=with_zeros)
        elif self._overtaken_cause is not None and self._restop_at_s is not None and now_s >= self._restop_at_s:
            self._restop(self._overtaken_cause, now_s)

    def _restop(self, cause: str, now_s: float) -> None:
        self._restop_at_s = now_s + RESTOP_S
        if not self.is_acting and not self.actions:  # one that hangs is not repeated
            self.actions.append(lambda: self._run(cause, None))
            self._owner.changed.notify_all()

    def _lost(self) -> None:
        self._follow(self.safety.on_loss, "safety.peer_left")

    def _follow(self, policy: SafePolicy, cause: str) -> None:
        if policy != "hold":
            self._act(cause, with_zeros=policy == "zero")

    def _act(self, cause: str, *, with_zeros: bool = False) -> None:
        self.fired += 1
        self.watchdog.disarm()
        self.mover = self._retry = self._zeros = None
        if self._handling is not None:
            self._overtaken_cause = cause
            self._restop_at_s = time.monotonic() + RESTOP_S
        zeros_of = self.fired if with_zeros else None
        self.actions.append(lambda: self._run(cause, zeros_of))
        self._owner.changed.notify_all()

    def _run(self, cause: str, zeros_of: int | None) -> None:
        """The safety thread. One failed write must not leave it moving."""
        try:
            self._make_safe(cause)
        except BaseException:
            with self._owner.changed:
                wait_s = _RETRY_S[min(self.failures, len(_RETRY_S) - 1)]
                self.failures += 1
                self._retry = (time.monotonic() + wait_s, cause, zeros_of is not None)
            raise
        with self._owner.changed:
            self.failures, self._retry = 0, None
            if zeros_of is not None and zeros_of == self.fired:
                self._zeros = (zeros_of, time.monotonic() + ZEROS_FOR_S)
                self.woken()
            if self._owner.fence is not None and not self.actions:  # the stop's own may still wait behind this one
                self._owner.fence.made_safe(self)
