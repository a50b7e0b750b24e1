"""Carries out what the switchboard decides, on the real sockets. Event-loop thread only."""

from __future__ import annotations

import itertools
import logging
import time
from collections.abc import Callable
from typing import Protocol
from uuid import uuid4

from mosaic_core.words.codes import CloseCode
from mosaic_server.sockets.keep_alive import KeepAlive, KeepAlivePeriods
from mosaic_server.switchboard import Switchboard
from mosaic_server.switchboard.effects import CloseLink, Effect, KeepCatalogue, LimitFrames, SendToLink
from mosaic_server.switchboard.events import Event, LinkClosed, LinkOpened, PingDue, Side, SocketCondemned, Ticked

_log = logging.getLogger(__name__)


class Wire(Protocol):
    """The parts of a socket that the exchange needs; :class:`mosaic_server.sockets.link.Link` is the real one."""

    @property
    def heard_at_s(self) -> float: ...
    def send(self, text: str) -> bool: ...
    def limit_frames(self, size_bytes: int) -> None: ...
    def ping(self) -> None: ...
    def close(self, code: int, reason: str) -> None: ...


class Exchange:
    """The switchboard with sockets plugged in."""

    def __init__(
        self,
        switchboard: Switchboard,
        keep_catalogue: Callable[[KeepCatalogue], None],
        periods: KeepAlivePeriods | None = None,
    ) -> None:
        self.switchboard = switchboard
        self._keep_catalogue = keep_catalogue
        self._keep_alive = KeepAlive(periods or KeepAlivePeriods())
        self._wires: dict[int, Wire] = {}
        self._numbers = itertools.count(1)

    def open(self, wire: Wire, side: Side) -> int:
        """A socket was accepted; returns its number."""
        number = next(self._numbers)
        now_s = time.monotonic()
        self._wires[number] = wire
        self._keep_alive.watch(number, now_s)
        self.handle(LinkOpened(number, side, now_s))
        return number

    def closed(self, number: int, *, said_goodbye: bool = False) -> None:
        self._unplug(number)
        self.handle(LinkClosed(number, time.monotonic(), said_goodbye))

    def condemn(self, number: int, code: CloseCode) -> None:
        self.handle(SocketCondemned(number, code, time.monotonic()))

    def tick(self) -> None:
        """Call about once a second: finds dead sockets, sends pings, lets time pass on the switchboard."""
        now_s = time.monotonic()
        checked = self._keep_alive.check(now_s, lambda number: self._wires[number].heard_at_s)
        for number in checked.dead:
            self.condemn(number, CloseCode.TIMEOUT)
        for number in checked.ping:
            if number in self._wires:
                self._wires[number].ping()
                self.handle(PingDue(number, str(uuid4())))
        self.handle(Ticked(now_s))

    def handle(self, event: Event) -> list[Effect]:
        """Let the switchboard decide and carry it out; returns the effects for a caller that waits for an answer."""
        effects = self.switchboard.handle(event)
        too_slow = self._carry_out(effects)
        for number in dict.fromkeys(too_slow):
            self.condemn(number, CloseCode.TOO_SLOW)
        return effects

    def _carry_out(self, effects: list[Effect]) -> list[int]:
        """Returns the sockets that do not keep up."""
        too_slow: list[int] = []
        texts: dict[int, str] = {}
        for effect in effects:
            match effect:
                case SendToLink(socket=number, message=message):
                    text = texts.setdefault(id(message), "") or message.to_text()
                    texts[id(message)] = text  # one message to many operators is written once
                    if number in self._wires and not self._wires[number].send(text):
                        too_slow.append(number)
                case CloseLink(socket=number, code=code):
                    self._close(number, code, effect.reason)
                case LimitFrames(socket=number, size_bytes=size_bytes):
                    if number in self._wires:
                        self._wires[number].limit_frames(size_bytes)
                case KeepCatalogue():
                    self._keep_catalogue(effect)
                case _:
                    pass  # answers, for the caller of handle()
        return too_slow

    def _close(self, number: int, code: CloseCode, reason: str) -> None:
        wire = self._wires.get(number)
        if wire is not None:
            _log.info("closing socket %d: %s", number, reason, extra={"code": reason})
            self._unplug(number)
            wire.close(int(code), reason)

    def _unplug(self, number: int) -> None:
        self._wires.pop(number, None)
        self._keep_alive.forget(number)
