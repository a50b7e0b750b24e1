"""Watches how good each operator's link is: pings them, takes what they report, and says how much of the speed is left.

Written on the event loop, read on receivers' threads at the moment a command acts.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

from mosaic_core.machines.commands.link_quality import LinkQuality
from mosaic_core.machines.commands.slow_down import Cause, Measures, slow_down
from mosaic_core.words.control import Ping
from mosaic_core.words.limits import SlowDownCurves

_UNMEASURED = Measures()
_LAST_US = 2**63
"""No clock goes that far; a number of hundreds of digits would not fit a float."""


class MeasuredLink:
    """The measured quality of one operator's link. Any thread."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._quality = LinkQuality()

    def pinged(self) -> Ping:
        t0_us = int(time.monotonic() * 1e6)
        with self._lock:
            self._quality.pinged(t0_us)
        return Ping(t0=t0_us)

    def ponged(self, t0_us: int) -> None:
        with self._lock:
            self._quality.ponged(t0_us, time.monotonic())

    def command_seen(self, label: str, seq: int) -> None:
        with self._lock:
            self._quality.command_seen(seq, time.monotonic(), label)

    def channel_closed(self, label: str) -> None:
        with self._lock:
            self._quality.channel_closed(label)

    def picture_seen(self, label: str, capture_us: int | None) -> None:
        with self._lock:
            capture_s = None if capture_us is None else max(0, min(capture_us, _LAST_US)) / 1e6
            self._quality.picture_seen(label, capture_s, time.monotonic())

    def picture_unwatched(self, label: str) -> None:
        with self._lock:
            self._quality.picture_unwatched(label)

    def measures(self) -> Measures:
        """How good it is now."""
        with self._lock:
            return self._quality.measures(time.monotonic())

    def speed(self, curves: SlowDownCurves) -> tuple[float, tuple[Cause, ...]]:
        """The factor for commands that act now, and what makes it less than 1."""
        return slow_down(curves, self.measures())


class LinkWatch:
    """The links of all operators who know how to be measured."""

    def __init__(self) -> None:
        self._links: dict[str, MeasuredLink] = {}
        self.added: Callable[[], object] = lambda: None
        """Called when there is one more."""

    @property
    def peer_ids(self) -> tuple[str, ...]:
        return tuple(self._links)

    def add(self, peer_id: str) -> MeasuredLink:
        link = MeasuredLink()
        self._links = {**self._links, peer_id: link}  # replaced as a whole: receivers' threads read it
        self.added()
        return link

    def remove(self, peer_id: str) -> None:
        self._links = {key: link for key, link in self._links.items() if key != peer_id}

    def get(self, peer_id: str) -> MeasuredLink | None:
        return self._links.get(peer_id)

    def measures_of(self, peer_id: str) -> Measures:
        """How good the link of this peer is; of an original one, which can't be measured, nothing is known."""
        link = self._links.get(peer_id)
        return _UNMEASURED if link is None else link.measures()
