"""A limit makes a fraction of a command; whose class wants whole numbers gets one, and refuses what was none before."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import pytest
from pydantic import Field

from mosaic_core import DataChannelConfigurer, DataChannelReceivable, FieldBounds, Message, NoParams
from mosaic_core.testing import Silence, SlowedTo, build, feed


class Inner(Message):
    percent: int


class Wish(Message):
    percent: int = 0
    place: int | None = None
    places: list[int] = Field(default_factory=list)
    share: float | int = 0
    inner: Inner | None = None


class Mover(DataChannelReceivable[Wish]):
    timeout_s = 1.0
    motion_fields: ClassVar[tuple[str, ...]] = ("percent", "share", "inner.percent")
    position_fields: ClassVar[tuple[str, ...]] = ("place", "places.*")
    limits: Mapping[str, FieldBounds] = {
        "percent": FieldBounds(min=-100, max=100, max_rise_per_s=62.5),
        "place": FieldBounds(min=0, max=9, max_rate_per_s=6),
        "places.*": FieldBounds(min=0, max=9, max_rate_per_s=6),
    }

    def handle_data(self, data: Wish) -> None:
        """Taken by the script."""

    def make_safe(self, cause: str) -> None:
        """It stands by itself."""

    def reported_position(self, field: str) -> float | None:
        return 0


class MoverConfigurer(DataChannelConfigurer[NoParams]):
    def configure(self) -> Mover:
        return Mover(self.label)


def taken(*script: Any) -> Sequence[Any]:
    fed = feed(build(MoverConfigurer), script)
    assert fed.refused == []
    return fed.accepted


def repeated(message: dict[str, Any], times: int) -> list[Any]:
    return [step for _ in range(times) for step in (message, Silence(0.05))]


@pytest.mark.parametrize("wish", [100, -100])
def test_a_velocity_that_rises_slowly_is_cut_towards_zero(wish: int) -> None:
    sign = wish // 100
    steps = [one.percent for one in taken(*repeated({"percent": wish}, 5))]
    assert steps == [sign * step for step in (6, 9, 12, 15, 18)], "6.25, then 3.125 more each"


def test_a_position_is_rounded_and_gets_there() -> None:
    places = [one.place for one in taken(*repeated({"place": 2}, 9))]
    assert places == [1, 1, 1, 1, 2, 2, 2, 2, 2], "0.6, 0.9, 1.2, 1.49…, 1.8, 2"


@pytest.mark.parametrize(("wish", "place"), [(99, 8), (-99, 1)])
def test_a_position_is_not_rounded_out_of_its_range(wish: int, place: int) -> None:
    limits = {"place": {"min": 0.5, "max": 8.5, "max_rate_per_s": 1000}}
    fed = feed(build(MoverConfigurer, safety={"limits": limits}), [{"place": wish}])
    assert [one.place for one in fed.accepted] == [place]


def test_the_numbers_of_a_list_are_rounded_each_for_itself() -> None:
    last = taken(*repeated({"places": [2, 0]}, 9))[-1]
    assert last.places == [2, 0]


def test_a_bad_link_leaves_whole_numbers_and_fractions_where_they_may_be() -> None:
    message = {"percent": 4, "share": 3, "inner": {"percent": 7}}
    (one,) = taken(SlowedTo(0.5), message)
    assert (one.percent, one.share, one.inner) == (2, 1.5, Inner(percent=3))


def test_what_was_no_whole_number_before_is_refused() -> None:
    fed = feed(build(MoverConfigurer), [{"percent": 1.5}, {"place": 0.25}, {"places": [0.1]}])
    assert [one.code for one in fed.refused] == ["channel.invalid"] * 3
