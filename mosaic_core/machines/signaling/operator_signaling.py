"""The operator's side of the signaling socket, as a machine.

::

    offline ──opened──► greeting ──authorize.req──► authorizing ──100──► (welcoming) ──► ready ──closed──► offline
                                                         └── refused ──► stopped

A refused token stops it: nothing but a new log-in helps. Everything else is tried again with back-off.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from mosaic_core.machines.signaling.signaling_events import ChangeState, SendSignal
from mosaic_core.machines.signaling.signaling_session import SignalingSession, SocketEffect, SocketEvent
from mosaic_core.words import signaling as wire
from mosaic_core.words.codes import CLOSE_REASONS, CloseCode
from mosaic_core.words.errors import WireError


@dataclass(frozen=True, slots=True)
class Deliver:
    """A message for the rest of the operator."""

    message: wire.SignalingMessage


@dataclass(frozen=True, slots=True)
class RobotsWatched:
    """Hear of these robots, now and after every reconnection."""

    robot_ids: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class ServerDoubted:
    """Ask for what is answered at once, to see whether the server is still there."""


Event = SocketEvent | RobotsWatched | ServerDoubted
Effect = SocketEffect | Deliver


class OperatorSignaling(SignalingSession):
    """Decides for an operator: subscribes to robots, and stops for good where its token is refused."""

    def __init__(self, access_token: str, draw: Callable[[], float]) -> None:
        super().__init__(draw)
        self._access_token = access_token
        self._robot_ids: tuple[str, ...] = ()

    def _own(self, event: RobotsWatched | ServerDoubted) -> Sequence[Effect]:
        if isinstance(event, RobotsWatched):
            self._robot_ids = tuple(dict.fromkeys(event.robot_ids))
        return self._subscription()

    def _closed(self, close_code: int | None, now_s: float) -> Sequence[Effect]:
        if close_code in (CloseCode.AUTH, CloseCode.FORBIDDEN) and not self._refusal:
            self._refusal = CLOSE_REASONS[close_code]
        return self._stopped(self._refusal) if self._refusal else self._lost_by(close_code, now_s)

    def _frame(self, text: str, now_s: float) -> Sequence[Effect]:
        try:
            message = self._read(text, now_s)
        except WireError:
            return []  # a server that is newer than us may say what we don't understand
        if self.state != "ready" or isinstance(message, wire.PingPing):
            return self._before_session(message, now_s)
        return [Deliver(message)]

    def _credentials(self) -> wire.Authorize:
        return wire.Authorize(access_token=self._access_token, extensions=self.agreed or None)

    def _authorized(self, code: int, now_s: float) -> Sequence[Effect]:
        effects = super()._authorized(code, now_s)
        return [*self._stopped(self._refusal), *effects] if self._refusal else effects

    def _ready(self, now_s: float) -> Sequence[Effect]:
        self._became_ready(now_s)
        self._reported = ""
        return [ChangeState("ready"), *self._subscription()]

    def _subscription(self) -> Sequence[Effect]:
        if self.state != "ready" or not self._robot_ids:
            return []
        return [SendSignal(wire.StatusSubscribe(robot_ids=self._robot_ids))]
