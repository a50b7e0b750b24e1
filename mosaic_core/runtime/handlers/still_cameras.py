"""Tells of cameras that are watched and have come to a halt: their bodies hang in a driver or a network that never
answers, and neither end nor fail."""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Mapping

from mosaic_core.runtime.handlers.runner import Runner
from mosaic_core.runtime.media.media_hub import MediaHub
from mosaic_core.runtime.observation.counters import ConnectorCounters

logger = logging.getLogger(__name__)

STILL_S = 10.0
"""Longer than a camera warms up or changes its mode; whoever looks at a frozen picture wonders sooner."""
PERIOD_S = 2.0


class StillCameras:
    """Looks after the bodies of all cameras in ``media`` now and then. A body that rests in ``every`` or ``pause`` is
    told by nobody: it gives its next picture when it wants. Event loop only."""

    def __init__(
        self, media: MediaHub, runners: Mapping[str, Runner], counters: Mapping[str, ConnectorCounters]
    ) -> None:
        self._media = media
        self._runners = runners
        self._counters = counters
        self._told: set[str] = set()
        self._timer: asyncio.TimerHandle | None = None

    def start(self) -> None:
        """Begin to look, and go on until :meth:`close`."""
        self._timer = asyncio.get_running_loop().call_later(PERIOD_S, self.start)
        self._look()

    def close(self) -> None:
        if self._timer is not None:
            self._timer.cancel()

    def _look(self) -> None:
        self._told &= {*self._media.cameras()}
        for label in self._media.cameras():
            runner = self._runners.get(label)
            if runner is None:
                continue
            last_s = self._counters[label].last_at_s or 0.0  # a body may push its pictures instead
            if min(runner.still_s(), time.monotonic() - last_s) < STILL_S:
                self._goes_on(label, runner)
            elif label not in self._told and self._media.viewers(label):
                self._told.add(label)
                place, fields = runner.place(), {"label": label, "code": "media.not_sent"}
                at = f"; its body is at {place}" if place else ""
                text = "camera %r is watched and has given no picture for %.0f s (media.not_sent)%s"
                logger.warning(text, label, STILL_S, at, extra=fields)

    def _goes_on(self, label: str, runner: Runner) -> None:
        if label in self._told:
            self._told.discard(label)
            if runner.state == "running":
                logger.warning("camera %r gives pictures again", label, extra={"label": label})
