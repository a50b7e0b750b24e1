"""A bound that a command could say and leaves out is its limit: leaving it out goes round no limit."""

from __future__ import annotations

from typing import Any

import pytest

from mosaic_core import DataChannelConfigurer, DataChannelReceivable, Message, NoParams
from mosaic_core.messages import GripperTarget
from mosaic_core.testing import Silence, build, feed


class Grip(Message):
    max_effort: float | None = None
    max_speed: float = 3.0
    force: float | None = None


class Hand(Message):
    position: float
    grip: Grip | None = None


class Gripper(DataChannelReceivable[GripperTarget]):
    def handle_data(self, data: GripperTarget) -> None:
        """Takes everything."""


class GripperConfigurer(DataChannelConfigurer[NoParams]):
    def configure(self) -> Gripper:
        return Gripper(self.label)


class Taker(DataChannelReceivable[Hand]):
    def handle_data(self, data: Hand) -> None:
        """Takes everything."""


class TakerConfigurer(DataChannelConfigurer[NoParams]):
    def configure(self) -> Taker:
        return Taker(self.label)


def taken(configurer: Any, limits: dict[str, Any], message: dict[str, Any]) -> Any:
    (data,) = feed(build(configurer, safety={"limits": limits}), [message]).accepted
    return data


@pytest.mark.parametrize(("said", "effort"), [({}, 5.0), ({"max_effort": 50}, 5.0), ({"max_effort": 0}, 0.0)])
def test_who_leaves_a_bound_out_presses_no_harder_than_its_limit(said: dict[str, Any], effort: float) -> None:
    target = taken(GripperConfigurer, {"max_effort": {"max": 5}}, {"position": 0.03, **said})
    assert (target.position, target.max_effort) == (0.03, effort)


def test_what_nobody_limits_stays_unsaid() -> None:
    assert taken(GripperConfigurer, {"position": {"max": 0.1}}, {"position": 0.03}).max_effort is None
    assert taken(GripperConfigurer, {"max_effort": {"min": 0}}, {"position": 0.03}).max_effort is None


def test_a_part_that_is_said_has_its_bounds_and_one_that_is_not_stays_out() -> None:
    limits = {"grip.max_effort": {"max": 5}, "grip.max_speed": {"max": 4}, "grip.force": {"max": 1}}
    assert taken(TakerConfigurer, limits, {"position": 0, "grip": {}}).grip == Grip(max_effort=5, max_speed=3)
    assert taken(TakerConfigurer, limits, {"position": 0}).grip is None


def test_zeros_of_the_framework_say_it_too() -> None:
    class Turns(Message):
        speed: float
        max_effort: float | None = None

    got: list[Turns] = []

    class Screw(DataChannelReceivable[Turns]):
        timeout_s = 0.5
        motion_fields = ("speed",)

        def handle_data(self, data: Turns) -> None:
            got.append(data)

        def make_safe(self, cause: str) -> None: ...

    class ScrewConfigurer(DataChannelConfigurer[NoParams]):
        def configure(self) -> Screw:
            return Screw(self.label)

    safety = {"on_timeout": "zero", "limits": {"max_effort": {"max": 5}}}
    feed(build(ScrewConfigurer, safety=safety), [{"speed": 1}, Silence(0.7)])
    assert [(one.speed, one.max_effort) for one in (got[0], got[1])] == [(1.0, 5.0), (0.0, 5.0)]
