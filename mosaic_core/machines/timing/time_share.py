"""Keeps one kind of work to its share of an event loop's time: what it took is paid back by waiting.

This is the virtual scheduling of ITU-T I.371 (GCRA) with time in place of cells.
"""

from __future__ import annotations


class TimeShare:
    """``share`` of the time, 0 to 1; ``credit_s`` may be taken at once. Any monotonic clock."""

    def __init__(self, share: float, credit_s: float) -> None:
        self._share = share
        self._credit_s = credit_s
        self._paid_back_at_s = float("-inf")

    def wait_s(self, now_s: float) -> float:
        """How long to wait before more of the work; 0: go on."""
        return max(0.0, self._paid_back_at_s - self._credit_s - now_s)

    def took(self, began_s: float, ended_s: float) -> None:
        """So long the work kept the loop."""
        self._paid_back_at_s = max(self._paid_back_at_s, began_s) + (ended_s - began_s) / self._share
