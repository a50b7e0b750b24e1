"""Names of flight modes, per autopilot."""

from __future__ import annotations

from typing import get_args

import pytest

from mosaic_mavlink.link.flight_modes import (
    LossAction,
    VehicleClass,
    action_mode,
    guided_mode,
    mode_name,
    mode_order,
    modes_of,
    stick_modes,
    vehicle_class,
)

KNOWN: tuple[VehicleClass, ...] = ("copter", "plane", "rover", "sub", "px4")


def test_a_heartbeat_says_whose_modes_count() -> None:
    assert [vehicle_class(3, one) for one in (2, 1, 10, 12, 20, 26)] == [
        "copter", "plane", "rover", "sub", "plane", "unknown",
    ]  # fmt: skip
    assert vehicle_class(12, 2) == vehicle_class(12, 10) == "px4"
    assert vehicle_class(8, 2) == "unknown"


def test_modes_by_hand() -> None:
    assert (mode_name("copter", 4), mode_name("rover", 15), mode_name("plane", 5)) == ("GUIDED", "GUIDED", "FBWA")
    assert (mode_name("px4", 6 << 16), mode_name("px4", 4 << 16 | 3 << 24)) == ("OFFBOARD", "HOLD")
    assert mode_name("px4", 3 << 16 | 1 << 24) == "POSCTL"
    assert mode_name("copter", 99) == mode_name("unknown", 99) == "mode 99"


@pytest.mark.parametrize("kind", KNOWN)
def test_each_mode_is_named_as_it_is_ordered(kind: VehicleClass) -> None:
    for name in modes_of(kind):
        order = mode_order(kind, name)
        assert order is not None
        assert mode_name(kind, order.custom << 16 | order.sub << 24 if kind == "px4" else order.custom) == name


@pytest.mark.parametrize("kind", KNOWN)
def test_each_mode_that_is_meant_for_something_exists(kind: VehicleClass) -> None:
    actions = (action_mode(kind, action) for action in get_args(LossAction))
    assert {guided_mode(kind), *stick_modes(kind), *filter(None, actions)} <= set(modes_of(kind))


def test_a_rover_can_not_land_and_nobody_holds_what_is_unknown() -> None:
    assert action_mode("rover", "land") is None
    assert action_mode("unknown", "hold") is None
    assert mode_order("unknown", "GUIDED") is None
    assert modes_of("unknown") == ()
