"""Decides who may command now: the leases and the stop, under the same lock as the safe actions.

A receiver asks here when a command begins to act, on its own thread; the event loop changes leases and says stop. So a
command that was admitted before a change either began to act before it, and is made safe by it, or never acts.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable

from mosaic_core.machines.commands.admission import (
    ArrivedCommand,
    CommandChannel,
    lease_code,
    refusal_on_arrival,
    stop_code,
)
from mosaic_core.machines.commands.gates import GateRefusal
from mosaic_core.machines.control.lease_desk import LeaseDesk
from mosaic_core.machines.control.lease_events import (
    Commanded,
    DeadlinePassed,
    Effect,
    Event,
    LeaseChanged,
    LegacyPeers,
)
from mosaic_core.machines.control.stop_latch import StopLatch, StopTimes
from mosaic_core.machines.timing.pacing import TokenBucket
from mosaic_core.runtime.commands.safety_watch import SafetyWatch
from mosaic_core.runtime.commands.safety_watchdog import SafetyWatchdog
from mosaic_core.runtime.configuration.receiver_safety import ReceiverSafety

SAFE = "safe"
"""Told instead of an effect of the leases: every safe action of the stop has returned."""


class Fence:
    """Refuses commands of who holds no lease, and every command while stopped.

    Every method may be called from any thread; none waits for a safe action.

    ``tell`` is called under the lock, on any thread, with each effect of the leases and with :data:`SAFE`: it must only
    pass them on.
    """

    def __init__(
        self, watchdog: SafetyWatchdog, desk: LeaseDesk, latch: StopLatch, tell: Callable[[Effect | str], object]
    ) -> None:
        self._watchdog = watchdog
        self.lock = watchdog.changed
        self.desk = desk
        """Look at it, and at :attr:`latch`, only under :attr:`lock`."""
        self.latch = latch
        self._tell = tell
        self._unsafe: set[SafetyWatch] = set()
        watchdog.fence = self

    def add_resources(self, resources: Iterable[str]) -> tuple[str, ...]:
        """There are leases of these from now on; those that were new."""
        with self.lock:
            return self.desk.add(resources)

    def refusal(
        self, safety: ReceiverSafety, peer_id: str, epoch: int | None, now_s: float | None = None
    ) -> str | None:
        """Why a command of this peer may not act now; ``epoch`` ``None``: it came on a bare channel."""
        if not safety.is_motion:
            return None
        with self.lock:
            at_s = time.monotonic() if now_s is None else now_s
            return lease_code(safety, self.desk, peer_id, epoch, at_s) or stop_code(safety, self.latch)

    @property
    def is_stopped(self) -> bool:
        return self.latch.is_stopped

    def channel(
        self, safety: ReceiverSafety, legacy: LegacyPeers, max_age_s: float | None, rate: TokenBucket | None
    ) -> CommandChannel:
        """What commands on one channel to such a receiver are measured by."""
        return CommandChannel(safety, self.desk, self.latch, legacy, max_age_s, rate)

    def refusal_on_arrival(self, arrival: ArrivedCommand) -> GateRefusal | None:
        """Why a command that has just arrived need not wait for its turn."""
        with self.lock:
            return refusal_on_arrival(arrival)

    def commanded(self, safety: ReceiverSafety, peer_id: str, now_s: float) -> None:
        """A command acts: a sign of life of the holder, and how an original peer takes a free lease. ``now_s``: when
        it was found not to be refused, so that the lease can't expire between the two."""
        if safety.resource is not None:
            self.handle(Commanded(peer_id, safety.resource), now_s)

    def handle(self, event: Event, now_s: float | None = None) -> None:
        """Something happens to the leases: what it ends is made safe before anybody hears of it."""
        with self.lock:
            for effect in self.desk.handle(event, time.monotonic() if now_s is None else now_s):
                if isinstance(effect, LeaseChanged) and effect.before is not None:
                    self._lease_lost(effect.resource, effect.before.peer_id)
                self._tell(effect)
            self._watchdog.deadline_moved(self.desk.deadline_s)

    def _lease_lost(self, resource: str, peer_id: str) -> None:
        for watch in self._watchdog.watches:
            if watch.safety.resource == resource:
                watch.lease_lost(peer_id)

    def stop(self, by: str, reason: str, stop_id: str) -> tuple[bool, StopTimes]:
        """Latch; ``True`` if it was not stopped before: then every motion receiver's safe action has been set going."""
        with self.lock:
            is_new = self.latch.stop(by, reason, stop_id, time.monotonic())
            if is_new:
                self._unsafe = {watch for watch in self._watchdog.watches if watch.safety.is_motion}
                for watch in self._unsafe:
                    watch.stop()
                if not self._unsafe:
                    self.latch.made_safe(time.monotonic())
            times = self.latch.times(stop_id)
            assert times is not None
            return is_new, times

    def made_safe(self, watch: SafetyWatch) -> None:
        """A safe action has returned. The lock is held."""
        if watch in self._unsafe:
            self._unsafe.discard(watch)
            if not self._unsafe:
                self.latch.made_safe(time.monotonic())
                self._tell(SAFE)

    # -- for the safety threads: a lease ends in time, also while the event loop stands still ------------------------

    @property
    def due_at_s(self) -> float | None:
        return self.desk.deadline_s

    def expire(self, now_s: float) -> None:
        due_s = self.desk.deadline_s
        if due_s is not None and now_s >= due_s:
            self.handle(DeadlinePassed())
