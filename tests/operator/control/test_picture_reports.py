"""The robot hears how old the shown pictures are, ten times a second at most, and only where the clocks are known."""

from __future__ import annotations

from mosaic_core.machines.media.capture_clock import capture_us
from mosaic_core.operator.control.picture_reports import PictureReports
from mosaic_core.words.control import MEDIA_SEEN_PERIOD_S

PERIOD_US = int(MEDIA_SEEN_PERIOD_S * 1e6)
ORIGIN = 1234


class Place:
    """An operator with a clock that a test moves, and a robot whose clock runs an hour ahead."""

    def __init__(self, *, knows_clock: bool = True) -> None:
        self.now_us = 1_000_000
        self.told: list[tuple[str, int]] = []
        self._knows_clock = knows_clock
        self.reports = PictureReports(lambda *told: self.told.append(told), self.robot_now_us, lambda: self.now_us)

    def robot_now_us(self) -> int | None:
        return self.now_us + 3_600_000_000 if self._knows_clock else None

    def rtp_of(self, age_us: int) -> int:
        """The timestamp of a picture that was captured this long ago."""
        return ((self.now_us + 3_600_000_000 - age_us) * 9 // 100 + ORIGIN) % 2**32


def test_the_age_of_a_shown_picture_is_told_by_when_it_was_captured() -> None:
    place = Place()
    place.reports.origin_known("front", ORIGIN)
    rtp_timestamp = place.rtp_of(age_us=80_000)
    place.reports.shown("front", rtp_timestamp)
    assert place.told == [("front", capture_us(rtp_timestamp, ORIGIN, place.robot_now_us() or 0))]
    assert abs((place.robot_now_us() or 0) - place.told[0][1] - 80_000) < 20


def test_of_each_camera_it_is_told_once_in_a_period() -> None:
    place = Place()
    for label in ("front", "back"):
        place.reports.origin_known(label, ORIGIN)
    for later_us in (0, PERIOD_US - 1, 1):
        place.now_us += later_us
        for label in ("front", "back"):
            place.reports.shown(label, place.rtp_of(age_us=0))
    assert [label for label, _ in place.told] == ["front", "back"] * 2


def test_what_nobody_can_date_is_not_told() -> None:
    unknown_clock, place = Place(knows_clock=False), Place()
    unknown_clock.reports.origin_known("front", ORIGIN)
    unknown_clock.reports.shown("front", 90_000)
    place.reports.shown("front", 90_000)
    place.reports.origin_known("front", ORIGIN)
    place.reports.shown("front", None)
    assert unknown_clock.told == place.told == []
