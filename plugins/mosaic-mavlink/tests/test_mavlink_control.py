"""What moves a vehicle, and what it does when nobody does any more."""

from __future__ import annotations

import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as words

from mosaic_core.contract.handler import Refused
from mosaic_core.contract.host import Sender
from mosaic_core.messages import AngularVelocity, LinearVelocity, Twist
from mosaic_core.testing import Leaves, Silence, build, feed
from mosaic_core.words.errors import ConfigError
from mosaic_mavlink.control.loss import MotionParams
from mosaic_mavlink.control.manual import (
    ManualControl,
    MavlinkManual,
    MavlinkManualConfigurer,
    MavlinkManualSafety,
    sticks_message,
)
from mosaic_mavlink.control.velocity import (
    MavlinkVelocity,
    MavlinkVelocityConfigurer,
    MavlinkVelocitySafety,
    velocity_message,
)
from mosaic_mavlink.fake.autopilot import FakeAutopilot

ALICE, BOB = Sender("alice", "a"), Sender("bob", "b")
AHEAD = Twist.planar(x_mps=1.0, yaw_radps=0.2)
URL = "udpin:127.0.0.1:14550"


def guided(autopilot: FakeAutopilot, air: Any, mode: str = "GUIDED") -> None:
    autopilot._enter(mode)
    autopilot.armed = True
    air.pass_time(1.1)


def velocity(air: Any, **params: Any) -> MavlinkVelocity:
    wanted = MotionParams.model_validate({"url": URL, **params})
    return MavlinkVelocity("velocity", air.contact(), wanted, MavlinkVelocitySafety())


def manual(air: Any, **params: Any) -> MavlinkManual:
    wanted = MotionParams.model_validate({"url": URL, **params})
    return MavlinkManual("sticks", air.contact(), wanted, MavlinkManualSafety())


def test_a_velocity_moves_it_along_its_own_axes(air: Any, copter: FakeAutopilot) -> None:
    guided(copter, air)
    velocity(air).handle_data(Twist(linear=LinearVelocity(x=1, y=2, z=3), angular=AngularVelocity(z=0.5)), ALICE)
    body = copter.body
    assert (body.forward_mps, body.right_mps, body.up_mps, body.yaw_radps) == (1.0, -2.0, 3.0, -0.5)
    (sent,) = air.sent("SET_POSITION_TARGET_LOCAL_NED")
    assert (sent.coordinate_frame, sent.type_mask) == (8, 1479)


@given(st.tuples(*[st.floats(-50, 50)] * 4))
def test_a_velocity_message_is_the_twist_with_y_z_and_turn_the_other_way(parts: tuple[float, ...]) -> None:
    x, y, z, turn = parts
    _, fields = velocity_message(Twist(linear=LinearVelocity(x=x, y=y, z=z), angular=AngularVelocity(z=turn)))
    assert (fields["vx"], fields["vy"], fields["vz"], fields["yaw_rate"]) == (x, -y, -z, -turn)


@pytest.mark.parametrize(
    ("armed", "mode", "code"),
    [
        (False, "GUIDED", "mavlink.disarmed"),
        (True, "LOITER", "mavlink.wrong_mode"),
        (True, "AUTO", "mavlink.wrong_mode"),
    ],
)
def test_it_neither_arms_nor_changes_the_mode_but_says_what_is_missing(
    air: Any, copter: FakeAutopilot, armed: bool, mode: str, code: str
) -> None:
    guided(copter, air, mode)
    copter.armed = armed
    air.pass_time(1.1)
    with pytest.raises(Refused) as refused:
        velocity(air).handle_data(AHEAD, ALICE)
    assert refused.value.code == code
    assert (copter.armed, copter.mode) == (armed, mode)
    assert not air.sent("COMMAND_LONG")
    assert not air.sent("SET_POSITION_TARGET_LOCAL_NED")


def test_a_vehicle_that_is_away_is_no_device(air: Any) -> None:
    with pytest.raises(Refused) as refused:
        velocity(air).handle_data(AHEAD, ALICE)
    assert refused.value.code == "plugin.no_device"


def test_axes_that_it_does_not_have_are_refused(air: Any, copter: FakeAutopilot) -> None:
    guided(copter, air)
    with pytest.raises(Refused, match="turns around z alone"):
        velocity(air).handle_data(Twist(angular=AngularVelocity(x=0.1)), ALICE)


def test_what_it_could_not_do_on_loss_is_refused_before_it_moves(air: Any) -> None:
    rover = air.add("rover")
    air.contact()
    guided(rover, air)
    with pytest.raises(Refused, match="a rover knows no land"):
        velocity(air, on_loss="land").handle_data(AHEAD, ALICE)
    velocity(air, on_loss="rtl").handle_data(AHEAD, ALICE)


def test_a_plane_of_ardupilot_follows_no_velocities_and_is_told_how_it_is_flown(
    air: Any, copter: FakeAutopilot
) -> None:
    copter.mav_type, copter.vehicle_class = words.MAV_TYPE_FIXED_WING, "plane"
    guided(copter, air)
    with pytest.raises(Refused, match="a plane follows no velocities; fly it by sticks") as refused:
        velocity(air).handle_data(AHEAD, ALICE)
    assert refused.value.code == "mavlink.no_such_action"
    assert not air.sent("SET_POSITION_TARGET_LOCAL_NED")


@pytest.mark.parametrize(("kind", "mode"), [("copter", "GUIDED"), ("px4", "OFFBOARD"), ("rover", "GUIDED")])
@pytest.mark.parametrize(
    ("action", "modes"),
    [("hold", ("BRAKE", "HOLD", "HOLD")), ("rtl", ("RTL",) * 3), ("land", ("LAND", "LAND", "")), ("none", ("",) * 3)],
)
def test_silence_is_a_standstill_at_once_and_then_the_mode_of_choice(
    air: Any, kind: str, mode: str, action: str, modes: tuple[str, ...]
) -> None:
    if (kind, action) == ("rover", "land"):
        return
    autopilot = air.add(kind)
    air.contact()
    guided(autopilot, air, mode)
    autopilot.body.up_m = 50.0 if kind != "rover" else 0.0
    base = velocity(air, on_loss=action)
    base.handle_data(AHEAD, ALICE)
    assert autopilot.body.forward_mps == 1.0
    base.make_safe("safety.timeout")
    assert autopilot.body.forward_mps == autopilot.body.yaw_radps == 0.0
    air.pass_time(1.5)
    assert autopilot.mode == mode  # it is given the time to come back
    air.pass_time(1.5)
    assert autopilot.mode == (modes[["copter", "px4", "rover"].index(kind)] or mode)


def test_a_command_that_comes_back_in_time_goes_on(air: Any, copter: FakeAutopilot) -> None:
    guided(copter, air)
    base = velocity(air)
    base.handle_data(AHEAD, ALICE)
    base.make_safe("safety.timeout")
    air.pass_time(1.0)
    base.handle_data(AHEAD, ALICE)
    for _ in range(12):
        air.pass_time(0.25)
        base.handle_data(AHEAD, ALICE)
    assert copter.mode == "GUIDED"
    assert copter.body.forward_mps == 1.0


def test_a_stop_holds_at_once_whatever_would_follow_a_loss(air: Any, copter: FakeAutopilot) -> None:
    guided(copter, air)
    base = velocity(air, on_loss="rtl")
    base.handle_data(AHEAD, ALICE)
    base.make_safe("safety.stop")
    air.pass_time(0.1)
    assert copter.mode == "BRAKE"


def test_who_took_over_with_a_transmitter_is_not_overruled(air: Any, copter: FakeAutopilot) -> None:
    guided(copter, air)
    base = velocity(air, on_loss="rtl")
    base.handle_data(AHEAD, ALICE)
    base.make_safe("safety.timeout")
    copter._enter("LOITER")
    air.pass_time(5.0)
    assert copter.mode == "LOITER"
    base.make_safe("safety.stop")
    air.pass_time(2.0)
    assert copter.mode == "LOITER"


def test_an_order_that_gets_lost_is_given_again_until_it_is_followed(air: Any, copter: FakeAutopilot) -> None:
    guided(copter, air)
    base = velocity(air, on_loss_after_s=0)
    base.handle_data(AHEAD, ALICE)
    base.make_safe("safety.timeout")
    air.silent.add(1)
    air.pass_time(2.0)
    assert copter.mode == "GUIDED"
    air.silent.clear()
    air.pass_time(2.5)
    assert copter.mode == "BRAKE"
    orders = len(air.sent("COMMAND_LONG"))
    air.pass_time(5.0)
    assert len(air.sent("COMMAND_LONG")) == orders


def test_a_stick_that_was_let_go_is_no_loss_until_its_operator_leaves(air: Any, copter: FakeAutopilot) -> None:
    guided(copter, air)
    base = velocity(air)
    base.handle_data(AHEAD, ALICE)
    base.handle_data(Twist.planar(), ALICE)
    base.make_safe("safety.timeout")
    before = len(air.sent("SET_POSITION_TARGET_LOCAL_NED"))
    air.pass_time(20.0)
    assert copter.mode == "GUIDED"
    assert len(air.sent("SET_POSITION_TARGET_LOCAL_NED")) - before > 50  # PX4 would else leave OFFBOARD
    base.peer_left(BOB)
    air.pass_time(3.0)
    assert copter.mode == "GUIDED"
    base.peer_left(ALICE)
    air.pass_time(3.0)
    assert copter.mode == "BRAKE"


def test_a_velocity_is_said_again_but_never_for_longer_than_its_time_out(air: Any, copter: FakeAutopilot) -> None:
    guided(copter, air)
    velocity(air).handle_data(AHEAD, ALICE)
    air.pass_time(10.0)  # nobody calls make_safe
    assert 4 <= len(air.sent("SET_POSITION_TARGET_LOCAL_NED")) <= 6
    assert copter.body.forward_mps == 0.0


def test_who_never_commanded_makes_nothing_safe(air: Any, copter: FakeAutopilot) -> None:
    guided(copter, air)
    velocity(air).make_safe("safety.shutdown")
    manual(air).make_safe("safety.shutdown")
    air.pass_time(1.0)
    assert not air.sent("COMMAND_LONG")
    assert copter.mode == "GUIDED"


def test_sticks_by_hand() -> None:
    ahead = ManualControl(forward=1.0, left=0.5, up=-1.0, turn_left=-0.25)
    assert sticks_message("copter", ahead)[1] == {"x": 1000, "y": -500, "z": 0, "r": 250, "buttons": 0}
    assert sticks_message("px4", ManualControl())[1] == {"x": 0, "y": 0, "z": 500, "r": 0, "buttons": 0}
    assert sticks_message("rover", ahead)[1] == {"x": 0, "y": 250, "z": 1000, "r": 0, "buttons": 0}
    assert sticks_message("rover", ManualControl())[1] == {"x": 0, "y": 0, "z": 0, "r": 0, "buttons": 0}


def test_sticks_move_it_and_are_centred_on_silence(air: Any, copter: FakeAutopilot) -> None:
    guided(copter, air, "LOITER")
    sticks = manual(air)
    sticks.handle_data(ManualControl(forward=0.5, turn_left=1.0), ALICE)
    assert (copter.body.forward_mps, copter.body.yaw_radps) == (2.5, -1.0)
    sticks.make_safe("safety.timeout")
    assert (copter.body.forward_mps, copter.body.yaw_radps, copter.body.up_mps) == (0.0, 0.0, 0.0)
    air.pass_time(3.0)
    assert copter.mode == "BRAKE"


def test_sticks_are_not_taken_where_letting_go_is_a_fall(air: Any, copter: FakeAutopilot) -> None:
    guided(copter, air, "STABILIZE")
    with pytest.raises(Refused, match=r"in STABILIZE; sticks are taken in ALT_HOLD, FLOWHOLD, LOITER, POSHOLD"):
        manual(air).handle_data(ManualControl(), ALICE)


def test_a_policy_that_would_fly_on_is_refused_in_the_file() -> None:
    for configurer in (MavlinkVelocityConfigurer, MavlinkManualConfigurer):
        with pytest.raises(ConfigError, match=r"on_timeout: .*keeps its velocity is gone"):
            build(configurer, params={"url": "fake:"}, safety={"on_timeout": "hold"})
    with pytest.raises(ConfigError, match=r"params\.on_loss"):
        build(MavlinkVelocityConfigurer, params={"url": "fake:", "on_loss": "kill"})


def test_the_kit_s_script_of_silence_and_leaving_ends_in_the_safe_action(air: Any, copter: FakeAutopilot) -> None:
    guided(copter, air)
    base = velocity(air)
    built = build(MavlinkVelocityConfigurer, params={"url": "fake:"})
    built._contact, built._guard = base._contact, base._guard
    ahead = {"linear": {"x": 1.0}}
    fed = feed(built, [ahead, Silence(1.0), ahead, "{}", {"linear": {"x": math.nan}}, Leaves()])
    assert [one.cause for one in fed.made_safe] == ["safety.timeout", "safety.peer_left"]
    assert (len(fed.accepted), len(fed.refused)) == (2, 2)
    assert copter.body.forward_mps == 0.0
