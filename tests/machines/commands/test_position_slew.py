"""A position moves from where it is, within its range and at its rate, whatever stood between two commands."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.commands.position_slew import PAUSE_S, PositionUnknown, SaidInPart
from mosaic_core.machines.commands.safety_envelope import OutOfRange, SafetyEnvelope
from mosaic_core.machines.commands.slew import MAX_RISE_STEP_S
from mosaic_core.words.codes import REASONS
from mosaic_core.words.limits import FieldLimit


def limit(low: float | None = None, high: float | None = None, rate: float | None = None) -> FieldLimit:
    return FieldLimit(("angle",), low, high, max_rate_per_s=rate, kind="position")


class Joint:
    """One joint with an envelope. ``is_at``: what its sensor says; ``None``: it has none."""

    def __init__(self, its: FieldLimit, is_at: float | None = None) -> None:
        self.is_at = is_at
        self.asked = 0
        self.envelope = SafetyEnvelope([its], report=self._report)

    def _report(self, field: str) -> float | None:
        assert field == "angle"
        self.asked += 1
        return self.is_at

    def sent(self, wish: float, now_s: float, factor: float = 1.0) -> float:
        return float(self.envelope.shaped({"angle": wish}, factor, now_s).message["angle"])


# -- where it begins


@pytest.mark.parametrize("is_at", [60.0, None])
def test_an_arm_that_is_told_to_stay_after_a_safe_action_stays(is_at: float | None) -> None:
    """A velocity would begin at 0 here, and so swing the arm."""
    joint = Joint(limit(-90, 90, 90), 60.0)
    assert joint.sent(60.0, 0.0) == 60.0
    joint.is_at = is_at
    joint.envelope.stand_still()
    assert joint.sent(60.0, 0.5) == 60.0


def test_a_position_deep_in_a_message_is_held_back_there_and_nowhere_else() -> None:
    bound = FieldLimit(("arm.elbow.angle",), max_rate_per_s=90, kind="position")
    envelope = SafetyEnvelope([bound], report=lambda field: -40.0)
    wish = {"arm": {"elbow": {"angle": 60.0, "unit": "deg"}, "side": "left"}, "number": 7}
    sent = envelope.shaped(wish, 1.0, 0.0).message
    angle = sent["arm"]["elbow"].pop("angle")
    assert angle == pytest.approx(-40.0 + 90 * MAX_RISE_STEP_S)
    assert sent == {"arm": {"elbow": {"unit": "deg"}, "side": "left"}, "number": 7}


def test_it_begins_where_the_sensor_says_and_never_at_zero() -> None:
    assert Joint(limit(rate=90), -40.0).sent(60.0, 0.0) == pytest.approx(-40.0 + 90 * MAX_RISE_STEP_S)


def test_after_a_safe_action_it_begins_where_that_has_brought_it() -> None:
    joint = Joint(limit(rate=90), 60.0)
    joint.sent(60.0, 0.0)
    joint.envelope.stand_still()
    joint.is_at = 10.0
    assert joint.sent(60.0, 0.5) == pytest.approx(19.0)


@pytest.mark.parametrize(("pause_s", "begins_at"), [(PAUSE_S - 0.01, 60.0), (PAUSE_S, 10.0)])
def test_after_a_pause_a_hand_may_have_moved_it(pause_s: float, begins_at: float) -> None:
    joint = Joint(limit(rate=90), 60.0)
    joint.sent(60.0, 0.0)
    joint.is_at = 10.0
    assert joint.sent(90.0, pause_s) == pytest.approx(begins_at + 9.0)


def test_between_two_commands_a_joint_that_lags_behind_does_not_hold_them_back() -> None:
    joint = Joint(limit(rate=90), 0.0)
    assert [joint.sent(60.0, tick * 0.1) for tick in range(4)] == pytest.approx([9.0, 18.0, 27.0, 36.0])
    assert joint.asked == 1


@pytest.mark.parametrize("is_at", [None, math.nan, math.inf])
def test_what_would_have_to_begin_nowhere_is_refused(is_at: float | None) -> None:
    joint = Joint(limit(rate=90), is_at)
    with pytest.raises(PositionUnknown, match="nobody knows where angle is") as refused:
        joint.sent(60.0, 0.0)
    assert refused.value.code in REASONS
    joint.is_at = 55.0
    assert joint.sent(60.0, 0.1) == 60.0, "once it is known, it moves"


def test_without_a_rate_the_first_command_acts_as_it_is() -> None:
    joint = Joint(limit(5.0, 90.0))
    assert [joint.sent(60.0, 0.0), joint.sent(0.0, 0.1), joint.sent(180.0, 0.2)] == [60.0, 5.0, 90.0]
    assert joint.asked == 0


def test_a_safe_action_saves_up_no_second_step() -> None:
    joint = Joint(limit(rate=90), 0.0)
    joint.sent(60.0, 0.0)
    joint.is_at = None
    joint.envelope.stand_still()
    assert joint.sent(60.0, 0.01) == pytest.approx(9.0 + 0.9)


# -- range


def test_from_outside_its_range_it_comes_back_at_its_rate() -> None:
    joint = Joint(limit(5.0, 90.0, 10.0), 3.0)
    assert [joint.sent(60.0, tick * 0.1) for tick in range(3)] == pytest.approx([4.0, 5.0, 6.0])


def test_from_outside_it_is_never_sent_further_out() -> None:
    joint = Joint(limit(5.0, 90.0, 10.0), 3.0)
    assert [joint.sent(-60.0, tick * 0.1) for tick in range(4)] == pytest.approx([4.0, 5.0, 5.0, 5.0])


# -- slowing down


def test_the_factor_scales_the_rate_and_never_the_position() -> None:
    joint = Joint(limit(rate=90), 60.0)
    assert joint.sent(60.0, 0.0, factor=0.5) == 60.0
    assert joint.sent(90.0, 0.1, factor=0.5) == pytest.approx(64.5)


@pytest.mark.parametrize("rate", [90.0, None])
def test_a_factor_of_zero_holds(rate: float | None) -> None:
    joint = Joint(limit(rate=rate), 60.0)
    assert [joint.sent(wish, 0.0, factor=0.0) for wish in (0.0, 90.0)] == [60.0, 60.0]


def test_a_place_that_nobody_knows_cannot_be_held() -> None:
    with pytest.raises(PositionUnknown):
        Joint(limit(-90, 90)).sent(60.0, 0.0, factor=0.0)


def test_a_position_that_nothing_limits_is_taken_as_it_is_and_held_too() -> None:
    envelope = SafetyEnvelope(position_fields=("angle",))
    assert envelope.shaped({"angle": 60}, 0.1, 0.0) == envelope.shaped({"angle": 60}, 1.0, 0.0)
    shaped = envelope.shaped({"angle": 90}, 0.0, 0.1)
    assert (shaped.message, shaped.was_limited) == ({"angle": 60}, True)


# -- zero, idle, motion


def test_zero_is_a_place_like_any_other() -> None:
    joint = Joint(limit(rate=90), 0.0)
    shaped = [joint.envelope.shaped({"angle": 0.0}, 1.0, tick * 0.25) for tick in range(9)]
    assert all(one.wants_motion for one in shaped)
    assert not any(one.is_zero or one.is_idle or one.was_limited for one in shaped)


def test_beside_a_velocity_that_stands_a_position_that_moves_is_handed_on() -> None:
    envelope = SafetyEnvelope([limit(rate=10)], ("speed",), report=lambda name: 0.0)
    wish = {"speed": 0.0, "angle": 3.0}
    idle = [envelope.shaped(wish, 1.0, tick * 0.1).is_idle for tick in range(20)]
    assert idle == [False] * 10 + [True] * 10
    assert not envelope.shaped({**wish, "angle": 2.0}, 1.0, 2.0).is_idle


def test_a_zero_of_the_framework_leaves_positions_where_they_are() -> None:
    envelope = SafetyEnvelope([limit(rate=10)], ("speed",))
    assert envelope.zero({"speed": 2.0, "angle": 60.0}) == {"speed": 0.0, "angle": 60.0}


def test_a_message_that_names_no_position_moves_none() -> None:
    joint = Joint(limit(rate=90))
    shaped = joint.envelope.shaped({"light": 1}, 1.0, 0.0)
    assert (shaped.message, shaped.wants_motion) == ({"light": 1}, False)


# -- several fields


def pose(*, norm: float | None = None, rate: float | None = None) -> FieldLimit:
    return FieldLimit(("x", "y"), None, None, norm, max_rate_per_s=rate, kind="position")


def test_fields_that_are_limited_together_move_on_a_straight_line() -> None:
    envelope = SafetyEnvelope([pose(rate=10)], report={"x": 1.0, "y": 1.0}.get)
    assert envelope.shaped({"x": 4.0, "y": 5.0}, 1.0, 0.0).message == pytest.approx({"x": 1.6, "y": 1.8})


def test_the_slowest_of_all_limits_that_share_a_field_counts() -> None:
    limits = [FieldLimit(("x",), max_rate_per_s=1.0, kind="position"), pose(rate=100.0)]
    for order in (limits, limits[::-1]):
        envelope = SafetyEnvelope(order, report=lambda name: 0.0)
        assert envelope.shaped({"x": 1.0, "y": 2.0}, 1.0, 0.0).message == pytest.approx({"x": 0.1, "y": 0.2})


def test_fields_that_are_limited_together_are_said_together() -> None:
    envelope = SafetyEnvelope([pose(norm=1.0)])
    with pytest.raises(SaidInPart, match="x and y are limited together"):
        envelope.shaped({"x": 0.5}, 1.0, 0.0)
    assert envelope.shaped({"x": 3.0, "y": 4.0}, 1.0, 0.0).message == pytest.approx({"x": 0.6, "y": 0.8})


def test_joints_with_limits_of_their_own_may_be_said_one_by_one() -> None:
    rates = [FieldLimit((name,), max_rate_per_s=10.0, kind="position") for name in ("a", "b")]
    envelope = SafetyEnvelope(rates, report=lambda name: 5.0)
    assert envelope.shaped({"b": 9.0}, 1.0, 0.0).message == {"b": 6.0}
    assert envelope.shaped({"a": 9.0}, 1.0, 0.1).message == {"a": 6.0}


@pytest.mark.parametrize("value", ["60", None, True, math.nan])
def test_what_is_no_number_is_refused_and_moves_nothing(value: Any) -> None:
    joint = Joint(limit(rate=90), 0.0)
    before = joint.envelope.state
    with pytest.raises(OutOfRange, match="angle"):
        joint.envelope.shaped({"angle": value}, 1.0, 0.0)
    assert joint.envelope.state == before


def test_a_command_that_was_refused_after_all_did_not_move_it() -> None:
    joint = Joint(limit(rate=90), 0.0)
    before = joint.envelope.state
    joint.sent(60.0, 0.0)
    joint.envelope.restore(before)
    assert joint.sent(60.0, 0.1) == pytest.approx(9.0)


# -- properties

PLACES = st.one_of(st.floats(-200, 200), st.just(0.0), st.floats(allow_nan=False, allow_infinity=False))
STEPS = st.one_of(st.floats(0, 0.2), st.floats(0, 5), st.just(0.0))
BETWEEN = st.sampled_from(["", "safe action", "lost sensor", "sensor"])
WALK = st.lists(st.tuples(PLACES, st.one_of(st.just(1.0), st.floats(0, 1)), STEPS, BETWEEN), min_size=1, max_size=30)


def walked(joint: Joint, walk: list[Any]) -> list[tuple[float, float, float]]:
    """``(seconds since the one before, where it was, where it was sent)``; the joint follows every command at once."""
    now_s, out = 5.0, []
    was_at = joint.is_at
    assert was_at is not None
    for wish, factor, step_s, between in walk:
        now_s += step_s
        if between == "safe action":
            joint.envelope.stand_still()
        joint.is_at = None if between == "lost sensor" and out else was_at
        sent = joint.sent(wish, now_s, factor)
        out.append((step_s, was_at, sent))
        was_at = sent
    return out


@given(st.floats(0.01, 500), st.floats(-100, 100), WALK)
def test_it_never_changes_faster_than_its_rate(rate: float, is_at: float, walk: list[Any]) -> None:
    for number, (step_s, was_at, sent) in enumerate(walked(Joint(limit(rate=rate), is_at), walk)):
        elapsed_s = MAX_RISE_STEP_S if number == 0 else min(step_s, MAX_RISE_STEP_S)
        assert abs(sent - was_at) <= rate * elapsed_s + 1e-9


@given(st.floats(-150, 150), st.floats(0, 150), st.floats(0, 1), st.one_of(st.none(), st.floats(0.01, 500)), WALK)
def test_it_never_leaves_its_range(low: float, width: float, share: float, rate: float | None, walk: list[Any]) -> None:
    high = low + width
    is_at = min(high, low + share * width)
    assert all(low <= sent <= high for _, _, sent in walked(Joint(limit(low, high, rate), is_at), walk))


@given(st.floats(0.01, 500), st.floats(-300, 300), WALK)
def test_from_outside_its_range_it_goes_nowhere_but_back(rate: float, is_at: float, walk: list[Any]) -> None:
    for _, was_at, sent in walked(Joint(limit(5.0, 90.0, rate), is_at), walk):
        assert min(was_at, 5.0) <= sent <= max(was_at, 90.0)


@given(st.floats(5, 90), st.one_of(st.none(), st.floats(0.01, 500)), WALK)
def test_told_to_be_where_it_is_it_never_moves(is_at: float, rate: float | None, walk: list[Any]) -> None:
    joint = Joint(limit(5.0, 90.0, rate), is_at)
    stays = [(is_at, factor, step_s, between) for _, factor, step_s, between in walk]
    assert [sent for _, _, sent in walked(joint, stays)] == [is_at] * len(walk)


@given(st.floats(1, 500), st.floats(-100, 100), st.floats(5, 90))
def test_whoever_goes_on_asking_gets_there(rate: float, is_at: float, wish: float) -> None:
    joint = Joint(limit(rate=rate), is_at)
    ticks = math.ceil(abs(wish - is_at) / (rate * 0.05)) + 2
    assert [joint.sent(wish, tick * 0.05) for tick in range(ticks)][-1] == wish


def test_a_velocity_knows_nothing_of_it() -> None:
    its = replace(limit(), kind="velocity", max_rise_per_s=90.0)
    envelope = SafetyEnvelope([its], report=lambda name: 60.0)
    assert envelope.shaped({"angle": 60.0}, 1.0, 0.0).message["angle"] == pytest.approx(9.0)
