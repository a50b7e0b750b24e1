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


def test_a_link_that_is_lost_takes_all_who_command_over_it_away(air: Any, copter: FakeAutopilot) -> None:
    guided(copter, air)
    base, sticks = velocity(air), manual(air)
    air.broken = OSError(5, "Input/output error")
    with pytest.raises(Refused, match="opening it again"):
        base.handle_data(Twist.planar(1.0), ALICE)
    for one in (base, sticks):
        assert one.keeper is not None
        assert "is lost: [Errno 5] Input/output error" in str(one.keeper.absence)


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


def flown(plane: FakeAutopilot, air: Any, firmware: tuple[int, int]) -> MavlinkManual:
    """The sticks of a plane of ArduPilot that lands when nobody moves them; it is moved, then nobody does."""
    plane.mav_type, plane.vehicle_class = words.MAV_TYPE_FIXED_WING, "plane"
    plane.firmware, plane.lacks = firmware, {"AUTOLAND"} if firmware < (4, 7) else set()
    sticks = manual(air, on_loss="land")
    guided(plane, air, "FBWA")
    sticks.handle_data(ManualControl(forward=1.0), ALICE)
    sticks.make_safe("safety.timeout")
    return sticks


def told(air: Any) -> list[str]:
    return [one.text for one in air.contact().vehicle.texts.since(0) if one.level == "warn"]


def test_a_plane_whose_firmware_lands_by_itself_lands(air: Any, copter: FakeAutopilot) -> None:
    flown(copter, air, (4, 7))
    air.pass_time(3.0)
    assert copter.mode == "AUTOLAND"
    assert told(air) == []


def test_of_a_plane_that_is_too_old_to_land_it_is_told_at_once_that_it_returns_and_it_does(
    air: Any, copter: FakeAutopilot, caplog: pytest.LogCaptureFixture
) -> None:
    flown(copter, air, (4, 6))
    said = "firmware 4.6 of this plane has no AUTOLAND: on_loss: land orders RTL"
    assert told(air) == [said]
    assert f"vehicle 1: {said}" in caplog.text
    air.pass_time(2.5)
    assert copter.mode == "RTL"


@pytest.mark.parametrize(("answers", "in_s"), [(True, 2.5), (False, 6.0)])
def test_a_plane_that_refuses_to_land_or_does_not_answer_is_ordered_home(
    air: Any, copter: FakeAutopilot, answers: bool, in_s: float
) -> None:
    """It does not tell its version."""
    air.drops = lambda name: name == "autopilot_version" or (name == "command_ack" and not answers)
    flown(copter, air, (4, 6))
    air.pass_time(in_s)
    assert copter.mode == "RTL"
    assert told(air) == ["it does not enter AUTOLAND; RTL is ordered instead"]


def test_a_refusal_of_what_another_ground_station_ordered_changes_nothing(air: Any, copter: FakeAutopilot) -> None:
    flown(copter, air, (4, 7))
    air.drops = lambda name: name == "command_ack"
    copter.lacks = {"AUTOLAND"}
    air.pass_time(2.5)
    order = {"command": words.MAV_CMD_DO_SET_MODE, "result": words.MAV_RESULT_DENIED}
    air.say("command_ack", target_system=7, target_component=190, **order)
    air.pass_time(0.5)
    assert told(air) == []


def test_a_mode_that_is_never_entered_is_told_when_it_is_given_up(air: Any, copter: FakeAutopilot) -> None:
    copter.lacks = {"RTL"}
    guided(copter, air)
    base = velocity(air, on_loss="rtl")
    base.handle_data(AHEAD, ALICE)
    base.make_safe("safety.timeout")
    air.pass_time(15.0)
    assert told(air) == ["it was ordered into RTL for 10 s and stays in GUIDED"]
    assert not air.contact().vehicle.is_insisting


@pytest.mark.parametrize("make", [velocity, manual])
def test_a_vehicle_that_is_away_for_thirty_seconds_takes_no_commands_and_then_moves_again(
    air: Any, copter: FakeAutopilot, make: Any
) -> None:
    guided(copter, air, "GUIDED" if make is velocity else "LOITER")
    mover, command = make(air), AHEAD if make is velocity else ManualControl(forward=0.2)
    mover.handle_data(command, ALICE)
    mover.make_safe("safety.stop")
    copter._enter("GUIDED" if make is velocity else "LOITER")
    air.silent.add(1)
    for _ in range(6):
        air.pass_time(5.0)
        with pytest.raises(Refused) as refused:
            mover.handle_data(command, ALICE)
        assert refused.value.code == "plugin.no_device"
    assert copter.body.forward_mps == 0.0
    air.silent.clear()
    air.pass_time(1.5)
    mover.handle_data(command, ALICE)
    assert copter.body.forward_mps == 1.0


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
