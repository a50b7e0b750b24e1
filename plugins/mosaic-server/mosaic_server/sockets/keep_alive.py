"""Decides when to ping and when to give a socket up. Pure; the clock is the caller's.

TCP alone keeps a cut cable for many minutes, so anything heard (message, pong) counts as life, and silence ends it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class KeepAlivePeriods:
    """Pings go out every ``ping_s``; ``silence_s`` without anything heard is death. A dead socket is found within
    ``silence_s`` + ``check_s``, 13 s by default; robots and operators were promised 15."""

    ping_s: float = 5.0
    silence_s: float = 12.0
    check_s: float = 1.0


@dataclass(frozen=True, slots=True)
class Checked:
    """The sockets to ping and to close after one check."""

    dead: list[int]
    ping: list[int]


class KeepAlive:
    """Watches all sockets of a server. One thread."""

    def __init__(self, periods: KeepAlivePeriods) -> None:
        self._periods = periods
        self._next_ping_s: dict[int, float] = {}
        self._checked_at_s: float | None = None
        self._merciful_until_s = 0.0

    def watch(self, socket: int, now_s: float) -> None:
        self._next_ping_s[socket] = now_s + self._periods.ping_s

    def forget(self, socket: int) -> None:
        self._next_ping_s.pop(socket, None)

    def check(self, now_s: float, heard_at_s: Callable[[int], float]) -> Checked:
        """Call about every ``check_s``."""
        self._forgive_own_silence(now_s)
        merciful = now_s < self._merciful_until_s
        silence_s = self._periods.silence_s
        dead = [one for one in self._next_ping_s if not merciful and now_s - heard_at_s(one) >= silence_s]
        ping = [one for one, at_s in self._next_ping_s.items() if now_s >= at_s]
        for socket in ping:
            self._next_ping_s[socket] = now_s + self._periods.ping_s
        return Checked(dead, [one for one in ping if one not in dead])

    def _forgive_own_silence(self, now_s: float) -> None:
        """If it was this process that slept (a suspended machine), everybody gets time to answer first."""
        if self._checked_at_s is not None and now_s - self._checked_at_s > self._periods.ping_s + self._periods.check_s:
            self._merciful_until_s = now_s + self._periods.silence_s
        self._checked_at_s = now_s
