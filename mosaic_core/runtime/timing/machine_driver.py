"""Drives a pure state machine on the event loop: hands it events and the time, and has its effects carried out."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from typing import Generic, Protocol, TypeVar

from mosaic_core.machines.timing.deadline import DeadlinePassed
from mosaic_core.runtime.timing.deadline_timer import DeadlineTimer

E_contra = TypeVar("E_contra", contravariant=True)
F_co = TypeVar("F_co", covariant=True)
Event = TypeVar("Event")
Effect = TypeVar("Effect")


class Machine(Protocol[E_contra, F_co]):
    """Decides without a clock, a socket or a thread; takes :class:`DeadlinePassed` among its events."""

    @property
    def deadline_s(self) -> float | None:
        """When it wants :class:`DeadlinePassed`, on the monotonic clock; ``None``: not at all."""

    def handle(self, event: E_contra | DeadlinePassed, now_s: float) -> Iterable[F_co]: ...


class MachineDriver(Generic[Event, Effect]):
    """Owns one machine and its timer. Event loop only.

    ``carry_out`` gets the effects in their order, and may tell further events: those are done with before the next
    effect is carried out.
    """

    def __init__(self, machine: Machine[Event, Effect], carry_out: Callable[[Effect], None]) -> None:
        self._machine = machine
        self._carry_out = carry_out
        self._timer = DeadlineTimer(self._deadline_passed)
        self._is_stopped = False

    def tell(self, event: Event) -> None:
        """Something happened, now."""
        self._tell(event)

    def start(self) -> None:
        """Begin to watch the deadline that the machine was made with."""
        self._timer.set(self._machine.deadline_s)

    def stop(self) -> None:
        """For good, also from within an effect: no event is taken, no effect carried out, no deadline watched any
        more."""
        self._is_stopped = True
        self._timer.cancel()

    def _deadline_passed(self) -> None:
        self._tell(DeadlinePassed())

    def _tell(self, event: Event | DeadlinePassed) -> None:
        if self._is_stopped:
            return
        for effect in self._machine.handle(event, time.monotonic()):
            self._carry_out(effect)
            if self._is_stopped:
                return
        self._timer.set(self._machine.deadline_s)
