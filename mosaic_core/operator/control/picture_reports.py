"""Tells the robot how old the pictures are that this operator looks at; it slows commands down by their age."""

from __future__ import annotations

from collections.abc import Callable

from mosaic_core.machines.media.capture_clock import capture_us
from mosaic_core.words.control import MEDIA_SEEN_PERIOD_S


class PictureReports:
    """Reports the age of the pictures that are shown. Event loop only. ``report(label, capture_us)``; ``robot_now_us``
    reads the robot's clock, ``None``: not known.
    """

    def __init__(
        self,
        report: Callable[[str, int], None],
        robot_now_us: Callable[[], int | None],
        clock_us: Callable[[], int],
    ) -> None:
        self._report = report
        self._robot_now_us = robot_now_us
        self._clock_us = clock_us
        self._origins: dict[str, int] = {}
        self._told_us: dict[str, int] = {}

    def origin_known(self, label: str, rtp_origin: int) -> None:
        """The robot has told how its clock and the timestamps of this track belong together."""
        self._origins[label] = rtp_origin

    def shown(self, label: str, rtp_timestamp: int | None) -> None:
        now_us, origin, robot_us = self._clock_us(), self._origins.get(label), self._robot_now_us()
        if rtp_timestamp is None or origin is None or robot_us is None:
            return
        told_us = self._told_us.get(label)
        if told_us is not None and now_us - told_us < MEDIA_SEEN_PERIOD_S * 1e6:
            return
        self._told_us[label] = now_us
        self._report(label, capture_us(rtp_timestamp, origin, robot_us))
