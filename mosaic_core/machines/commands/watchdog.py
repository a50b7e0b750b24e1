"""Notices that a motion receiver has been silent for too long: fires once per silence, and only after a first
command."""

from __future__ import annotations

from typing import TypeAlias

Feeding: TypeAlias = "tuple[float | None, str | None]"
"""When the watchdog was fed, and by whom."""


class Watchdog:
    """Time-out of one receiver. ``timeout_s`` ``None``: never fires, but still knows who commanded last."""

    def __init__(self, timeout_s: float | None) -> None:
        if timeout_s is not None and not timeout_s > 0:  # nor NaN
            raise ValueError("a time-out must be positive")
        self.timeout_s = timeout_s
        self._fed_at_s: float | None = None
        self._commander: str | None = None

    @property
    def due_at_s(self) -> float | None:
        """When it fires unless it is fed before; ``None``: not armed."""
        if self._fed_at_s is None or self.timeout_s is None:
            return None
        return self._fed_at_s + self.timeout_s

    def feed(self, peer_id: str, now_s: float) -> Feeding:
        """A command of ``peer_id`` begins to act; what was before, for :meth:`unfeed`."""
        before = (self._fed_at_s, self._commander)
        self._fed_at_s = now_s if self._fed_at_s is None else max(self._fed_at_s, now_s)
        self._commander = peer_id
        return before

    def unfeed(self, before: Feeding) -> None:
        """The command was refused after all and must not have kept anything alive."""
        if self._fed_at_s is not None:
            self._fed_at_s, self._commander = before

    def keep_deadline(self, before: Feeding) -> None:
        """The command ended with an error: it may have set something going, but has not kept anything alive."""
        fed_at_s = before[0]
        if self._fed_at_s is not None and fed_at_s is not None:
            self._fed_at_s = fed_at_s

    def expire(self, now_s: float) -> bool:
        """``True`` once when the time is over: the caller must run the safe action."""
        due_s = self.due_at_s
        if due_s is None or now_s < due_s:
            return False
        self._fed_at_s = None
        return True

    def peer_left(self, peer_id: str) -> bool:
        """``True`` if what this peer commanded may still be moving: the caller must run the safe action."""
        if self._fed_at_s is None or self._commander != peer_id:
            return False
        self._fed_at_s = None
        return True

    def disarm(self) -> None:
        """The safe action runs for another reason."""
        self._fed_at_s = None
