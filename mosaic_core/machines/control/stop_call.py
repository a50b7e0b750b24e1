"""Saying stop until the robot has answered: at once on both channels, again after 10 ms, then every 30 ms on its own.

A call ends when the robot has told that its safe actions have returned, or two seconds after its first answer.
"""

from __future__ import annotations

from dataclasses import dataclass

from mosaic_core.machines.timing.clock_offset import ClockSample
from mosaic_core.words.control import STOP_REPEAT_S, Stop, StopAck

FIRST_REPEAT_S = 0.01
"""A burst of losses is mostly shorter than this, and a robot that stops 20 ms sooner is worth one small packet."""
SAFE_PATIENCE_S = 2.0
"""How long after the first acknowledgement to ask on whether the safe actions have returned."""


@dataclass(frozen=True, slots=True)
class StopReport:
    """The outcome of a stop; times in seconds since it was said.

    ``acknowledged_s``: the answer was here. ``received_s``: the robot had it, and ``safe_s``: its last safe action had
    returned, both on the robot's clock and right to within ``uncertainty_s``; ``None`` where the clocks are not known
    or a safe action still ran two seconds later. ``copies``: how often it was said.
    """

    acknowledged_s: float
    received_s: float | None
    safe_s: float | None
    uncertainty_s: float | None
    copies: int
    is_safe: bool


@dataclass(frozen=True, slots=True)
class SayStop:
    """Send ``message`` on the stop channel; ``is_first``: and once on the control channel."""

    message: Stop
    is_first: bool = False


@dataclass(frozen=True, slots=True)
class StopCallEnded:
    """The call with this id is over."""

    id: str
    report: StopReport


Effect = SayStop | StopCallEnded


@dataclass(slots=True)
class _Call:
    message: Stop
    said_at_s: float
    repeat_at_s: float
    copies: int = 1
    acknowledged_at_s: float | None = None
    received_us: int | None = None
    clock: ClockSample | None = None


class StopCalls:
    """All unanswered stops of one connection. ``now_s`` is the monotonic clock that the offset speaks of."""

    def __init__(self) -> None:
        self._calls: dict[str, _Call] = {}

    @property
    def deadline_s(self) -> float | None:
        """When the driver must call :meth:`overdue`; ``None``: never."""
        return min((call.repeat_at_s for call in self._calls.values()), default=None)

    def say(self, id_: str, reason: str, now_s: float) -> list[Effect]:
        message = Stop(id=id_, reason=reason)
        self._calls[id_] = _Call(message, now_s, now_s + FIRST_REPEAT_S)
        return [SayStop(message, is_first=True)]

    def acknowledged(self, ack: StopAck, clock: ClockSample | None, now_s: float) -> list[Effect]:
        """The robot has answered one of the copies."""
        call = self._calls.get(ack.id)
        if call is None:
            return []
        if call.acknowledged_at_s is None:
            call.acknowledged_at_s, call.received_us, call.clock = now_s, ack.received_us, clock
        if ack.safe_us is None:
            return []
        return self._ended(call, ack.safe_us)

    def overdue(self, now_s: float) -> list[Effect]:
        """Repeat what is due, give up waiting for what takes too long."""
        effects: list[Effect] = []
        for call in list(self._calls.values()):
            if now_s < call.repeat_at_s:
                continue
            if call.acknowledged_at_s is not None and now_s >= call.acknowledged_at_s + SAFE_PATIENCE_S:
                effects += self._ended(call, None)
                continue
            call.copies += 1
            call.repeat_at_s = now_s + STOP_REPEAT_S
            effects.append(SayStop(call.message))
        return effects

    def forget(self) -> None:
        """The connection is gone."""
        self._calls.clear()

    def _ended(self, call: _Call, safe_us: int | None) -> list[Effect]:
        del self._calls[call.message.id]
        assert call.acknowledged_at_s is not None
        return [
            StopCallEnded(
                call.message.id,
                StopReport(
                    acknowledged_s=call.acknowledged_at_s - call.said_at_s,
                    received_s=_since(call, call.received_us),
                    safe_s=_since(call, safe_us),
                    uncertainty_s=None if call.clock is None else call.clock.round_trip_us / 2e6,
                    copies=call.copies,
                    is_safe=safe_us is not None,
                ),
            )
        ]


def _since(call: _Call, robot_us: int | None) -> float | None:
    """From our saying it to a moment of the robot's clock. Never negative: the offset is only known so well."""
    if robot_us is None or call.clock is None:
        return None
    return max(0.0, (robot_us - call.clock.offset_us) / 1e6 - call.said_at_s)
