"""Carries out what ``machines.control.stop_call`` decides: says stop until the robot has answered."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Sequence
from uuid import uuid4

from mosaic_core.machines.control import stop_call
from mosaic_core.machines.control.stop_call import StopReport
from mosaic_core.operator.control.control_channel import ControlChannel
from mosaic_core.runtime.timing.deadline_timer import DeadlineTimer
from mosaic_core.words.control import StopAck
from mosaic_core.words.errors import MosaicError


class StopCaller:
    """Says the stops of one connection until each is answered. Event loop only.

    ``clock_us`` is the clock that the channel's offset speaks of.
    """

    def __init__(self, channel: ControlChannel, clock_us: Callable[[], int]) -> None:
        self._channel = channel
        self._clock_us = clock_us
        self._calls = stop_call.StopCalls()
        self._reports: dict[str, asyncio.Future[StopReport]] = {}
        self._timer = DeadlineTimer(self._overdue)

    async def stop(self, reason: str) -> StopReport:
        """Say it at once, and go on until it is answered, also when the caller is cancelled."""
        id_ = uuid4().hex
        self._reports[id_] = asyncio.get_running_loop().create_future()
        try:
            self._carry_out(self._calls.say(id_, reason, self._now_s()))
            return await self._reports[id_]
        finally:
            self._reports.pop(id_, None)

    def acknowledged(self, ack: StopAck) -> None:
        self._carry_out(self._calls.acknowledged(ack, self._channel.clock.best, self._now_s()))

    def ended(self, error: MosaicError) -> None:
        """The connection has ended, or the robot takes no stop of this operator; who still waits is told."""
        self._calls.forget()
        self._timer.cancel()
        for report in self._reports.values():
            if not report.done():
                report.set_exception(error)

    def _now_s(self) -> float:
        return self._clock_us() / 1e6

    def _carry_out(self, effects: Sequence[stop_call.Effect]) -> None:
        for effect in effects:
            match effect:
                case stop_call.SayStop(message, is_first):
                    self._channel.send_on_stop_channel(message)
                    if is_first:
                        self._channel.send(message)
                case stop_call.StopCallEnded(id_, report):
                    waiting = self._reports.get(id_)
                    if waiting is not None and not waiting.done():
                        waiting.set_result(report)
        due_s = self._calls.deadline_s
        self._timer.set(None if due_s is None else time.monotonic() + due_s - self._now_s())

    def _overdue(self) -> None:
        self._carry_out(self._calls.overdue(self._now_s()))
