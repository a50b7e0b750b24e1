"""Whatever is asked for, what comes out is inside the limits and changes no faster than allowed."""

from __future__ import annotations

import copy
import math
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mosaic_core.machines.commands.safety_envelope import IDLE_AFTER_S, OutOfRange, SafetyEnvelope
from mosaic_core.machines.commands.slew import MAX_RISE_STEP_S
from mosaic_core.words.codes import REASONS
from mosaic_core.words.limits import FieldLimit

TWIST = ("linear.x", "linear.y", "angular.z")


def twist(x: float = 0.0, y: float = 0.0, z: float = 0.0) -> dict[str, Any]:
    return {"linear": {"x": x, "y": y}, "angular": {"z": z}}


def speeds(message: dict[str, Any]) -> tuple[float, float, float]:
    return message["linear"]["x"], message["linear"]["y"], message["angular"]["z"]


# -- order: clamp, scale, slew


def test_without_limits_and_at_full_speed_a_message_is_what_it_was() -> None:
    shaped = SafetyEnvelope((), TWIST).shaped(twist(1.0, 2.0, 3.0), 1.0, 0.0)
    assert shaped.message == twist(1.0, 2.0, 3.0)
    assert not shaped.was_limited


def test_an_integer_that_nothing_limits_stays_an_integer() -> None:
    shaped = SafetyEnvelope([FieldLimit(("pwm",), -200, 200)]).shaped({"pwm": 100}, 1.0, 0.0)
    assert (shaped.message["pwm"], type(shaped.message["pwm"])) == (100, int)


def test_the_factor_scales_every_motion_field_and_nothing_else() -> None:
    message = twist(1.0, -2.0, 4.0) | {"light": 1.0, "name": "x"}
    shaped = SafetyEnvelope((), TWIST).shaped(message, 0.5, 0.0)
    assert shaped.message == twist(0.5, -1.0, 2.0) | {"light": 1.0, "name": "x"}
    assert shaped.was_limited


def test_a_limited_field_is_scaled_even_if_nobody_called_it_a_motion_field() -> None:
    envelope = SafetyEnvelope([FieldLimit(("effort",), -5.0, 5.0)])
    assert envelope.shaped({"effort": 4.0}, 0.5, 0.0).message == {"effort": 2.0}


@pytest.mark.parametrize("wish", [0.8, 1.6, 100.0])
def test_who_asks_for_more_than_allowed_is_slowed_down_as_much_as_everybody(wish: float) -> None:
    envelope = SafetyEnvelope([FieldLimit(("linear.x",), None, 0.8)])
    assert envelope.shaped({"linear": {"x": wish}}, 0.5, 0.0).message == {"linear": {"x": 0.4}}


@pytest.mark.parametrize(
    ("wish", "factor", "wants"),
    [(twist(x=0.5), 1.0, True), (twist(x=0.5), 0.0, True), (twist(), 1.0, False), ({"linear": {}}, 1.0, False)],
    ids=["one field of three", "nothing is left of it", "a standstill", "nothing is said"],
)
def test_a_wish_to_move_is_told_by_the_wish_and_not_by_what_is_left_of_it(
    wish: dict[str, Any], factor: float, wants: bool
) -> None:
    """Whoever lets go says so with zeros; whom the link holds back has not let go."""
    envelope = SafetyEnvelope(motion_fields=("linear.x", "linear.y", "angular.z"))
    assert envelope.shaped(wish, factor, 0.0).wants_motion is wants


def test_clamping_comes_before_slewing() -> None:
    envelope = SafetyEnvelope([FieldLimit(("v",), -1.0, 1.0, None, 1.0, 1.0)])
    for tick in range(11):
        envelope.shaped({"v": 100.0}, 1.0, tick * 0.1)
    assert envelope.state.output[0] == pytest.approx(1.0)
    assert envelope.shaped({"v": 0.0}, 1.0, 1.1).message["v"] == pytest.approx(0.9), "no wind-up beyond the clamp"


def test_a_vector_is_clamped_by_its_length_and_keeps_its_direction() -> None:
    envelope = SafetyEnvelope([FieldLimit(("linear.x", "linear.y"), None, None, 1.0)])
    x, y, _ = speeds(envelope.shaped(twist(3.0, 4.0), 1.0, 0.0).message)
    assert [x, y] == pytest.approx([0.6, 0.8])


# -- slewing


def test_the_first_command_acts_at_once_but_rises_only_as_far_as_one_period_allows() -> None:
    envelope = SafetyEnvelope([FieldLimit(("v",), None, None, None, 2.0)])
    assert envelope.shaped({"v": 1.0}, 1.0, 100.0).message["v"] == pytest.approx(2.0 * MAX_RISE_STEP_S)


def test_a_pause_saves_up_no_jump() -> None:
    envelope = SafetyEnvelope([FieldLimit(("v",), None, None, None, 2.0)])
    envelope.shaped({"v": 0.0}, 1.0, 0.0)
    assert envelope.shaped({"v": 9.0}, 1.0, 60.0).message["v"] == pytest.approx(2.0 * MAX_RISE_STEP_S)


def test_it_rises_with_one_rate_and_falls_with_the_other() -> None:
    envelope = SafetyEnvelope([FieldLimit(("v",), None, None, None, 1.0, 3.0)])
    rising = [envelope.shaped({"v": 0.3}, 1.0, tick * 0.1).message["v"] for tick in range(4)]
    assert rising == pytest.approx([0.1, 0.2, 0.3, 0.3])
    assert envelope.shaped({"v": 0.0}, 1.0, 0.4).message["v"] == pytest.approx(0.0)


def test_a_change_of_sign_falls_to_zero_first_and_then_rises() -> None:
    envelope = SafetyEnvelope([FieldLimit(("v",), None, None, None, 1.0, 4.0)])
    for tick in range(4):
        envelope.shaped({"v": 0.4}, 1.0, tick * 0.1)
    assert envelope.state.output[0] == pytest.approx(0.4)
    assert envelope.shaped({"v": -1.0}, 1.0, 0.35).message["v"] == pytest.approx(0.2)
    assert envelope.shaped({"v": -1.0}, 1.0, 0.45).message["v"] == pytest.approx(-0.05), "50 ms to zero, 50 ms beyond"


def test_without_a_rate_for_falling_a_stop_is_at_once() -> None:
    envelope = SafetyEnvelope([FieldLimit(("v",), None, None, None, 1.0)])
    for tick in range(9):
        envelope.shaped({"v": 0.8}, 1.0, tick * 0.1)
    assert envelope.shaped({"v": 0.0}, 1.0, 0.81).message["v"] == 0.0


def test_after_a_safe_action_everything_begins_at_zero() -> None:
    envelope = SafetyEnvelope([FieldLimit(("v",), None, None, None, 1.0, 1.0)])
    for tick in range(11):
        envelope.shaped({"v": 1.0}, 1.0, tick * 0.1)
    envelope.stand_still()
    assert envelope.shaped({"v": 1.0}, 1.0, 1.1).message["v"] == pytest.approx(0.1), "it acts at once"
    assert envelope.shaped({"v": 1.0}, 1.0, 1.15).message["v"] == pytest.approx(0.15)


def test_a_command_that_was_refused_after_all_did_not_move_the_envelope() -> None:
    envelope = SafetyEnvelope([FieldLimit(("v",), None, None, None, 1.0, 1.0)])
    envelope.shaped({"v": 1.0}, 1.0, 0.0)
    before = envelope.state
    envelope.shaped({"v": 1.0}, 1.0, 0.1)
    envelope.restore(before)
    assert envelope.state == before
    assert envelope.shaped({"v": 1.0}, 1.0, 0.05).message["v"] == pytest.approx(0.15)


def test_a_clock_that_goes_back_moves_nothing() -> None:
    envelope = SafetyEnvelope([FieldLimit(("v",), None, None, None, 1.0, 1.0)])
    envelope.shaped({"v": 1.0}, 1.0, 10.0)
    assert envelope.shaped({"v": 1.0}, 1.0, 9.0).message["v"] == pytest.approx(0.1)
    assert envelope.shaped({"v": 1.0}, 1.0, 10.1).message["v"] == pytest.approx(0.2)


def test_a_clock_that_goes_back_turns_no_braking_into_speed() -> None:
    envelope = SafetyEnvelope([FieldLimit(("v",), None, None, None, None, 1.0)])
    envelope.shaped({"v": 1.0}, 1.0, 10.0)
    assert envelope.shaped({"v": 0.0}, 1.0, 9.5).message["v"] == 1.0


@pytest.mark.parametrize(("wish", "output"), [(-3.0, -1.0), (-0.5, -0.5), (0.5, 0.5), (3.0, 1.0)])
def test_the_length_of_a_single_field_is_its_distance_from_zero(wish: float, output: float) -> None:
    assert SafetyEnvelope([FieldLimit(("v",), None, None, 1.0)]).shaped({"v": wish}, 1.0, 0.0).message["v"] == output


def test_limits_that_share_a_field_move_together() -> None:
    """Else slewing one component would carry the vector out of its length."""
    envelope = SafetyEnvelope(
        [FieldLimit(("x", "y"), None, None, 1.0), FieldLimit(("x",), None, None, None, None, 0.5)]
    )
    envelope.shaped({"x": 1.0, "y": 0.0}, 1.0, 0.0)
    message = envelope.shaped({"x": 0.0, "y": 1.0}, 1.0, 0.2).message
    assert message["x"] == pytest.approx(0.9)
    assert math.hypot(message["x"], message["y"]) <= 1.0


def test_limits_that_share_a_field_move_together_in_whatever_order_they_are_written() -> None:
    limits = [FieldLimit(("x",), None, None, None, 0.5), FieldLimit(("x", "y"), None, None, 1.0)]
    for order in (limits, limits[::-1]):
        message = SafetyEnvelope(order).shaped({"x": 0.5, "y": 0.5}, 1.0, 0.0).message
        assert message == {"x": pytest.approx(0.05), "y": pytest.approx(0.05)}


def test_a_field_that_stays_where_it_is_holds_no_other_back() -> None:
    envelope = SafetyEnvelope([FieldLimit(("x",), None, None, None, 0.5), FieldLimit(("x", "y"), None, None, 1.0)])
    assert envelope.shaped({"x": 0.0, "y": 0.5}, 1.0, 0.0).message == {"x": 0.0, "y": 0.5}


def test_limits_that_share_no_field_do_not_wait_for_each_other() -> None:
    envelope = SafetyEnvelope(
        [FieldLimit(("slow",), None, None, None, 0.1), FieldLimit(("quick",), None, None, None, 100.0)]
    )
    message = envelope.shaped({"slow": 1.0, "quick": 1.0}, 1.0, 0.0).message
    assert message == {"slow": pytest.approx(0.01), "quick": 1.0}


def test_what_is_within_reach_is_reached_exactly() -> None:
    envelope = SafetyEnvelope([FieldLimit(("v",), None, None, None, 100.0)])
    envelope.shaped({"v": 0.7}, 1.0, 0.0)
    shaped = envelope.shaped({"v": 0.1}, 1.0, 0.1)
    assert (shaped.message["v"], shaped.was_limited) == (0.1, False), "0.7 + (0.1 - 0.7) would not be 0.1"


def test_a_standstill_saves_up_no_jump_however_long_it_is_repeated() -> None:
    envelope = SafetyEnvelope([FieldLimit(("v",), None, None, None, 2.0)])
    for now_s in (0.0, 0.05, 0.1):
        envelope.shaped({"v": 0.0}, 1.0, now_s)
    assert envelope.shaped({"v": 9.0}, 1.0, 0.12).message["v"] == pytest.approx(0.04)


@pytest.mark.parametrize("limits", [(), [FieldLimit(("v",), None, None, None, 1.0)]])
def test_a_standstill_has_no_sign(limits: list[FieldLimit]) -> None:
    value = SafetyEnvelope(limits, ("v",)).shaped({"v": -1.0}, 0.0, 0.0).message["v"]
    assert (value, math.copysign(1.0, value)) == (0.0, 1.0)


# -- missing fields


def test_a_missing_field_counts_as_zero_and_stays_missing() -> None:
    envelope = SafetyEnvelope([FieldLimit(("linear.x",), -1.0, 1.0)], TWIST)
    shaped = envelope.shaped({"angular": {"z": 1.0}}, 1.0, 0.0)
    assert shaped.message == {"angular": {"z": 1.0}}
    assert not shaped.was_limited


def test_leaving_a_field_out_stops_no_faster_than_zero_does() -> None:
    envelope = SafetyEnvelope([FieldLimit(("linear.x",), None, None, None, None, 2.0)], TWIST)
    envelope.shaped({"linear": {"x": 1.0}}, 1.0, 0.0)
    shaped = envelope.shaped({"angular": {"z": 1.0}}, 1.0, 0.1)
    assert shaped.message == {"angular": {"z": 1.0}, "linear": {"x": pytest.approx(0.8)}}
    assert shaped.was_limited
    assert envelope.shaped({"angular": {"z": 1.0}}, 1.0, 0.6).message == {"angular": {"z": 1.0}}


def test_a_message_without_any_motion_field_is_no_standstill() -> None:
    shaped = SafetyEnvelope((), TWIST).shaped({"bogus": 1}, 1.0, 0.0)
    assert not shaped.is_zero
    assert shaped.message == {"bogus": 1}


# -- what is no number


@pytest.mark.parametrize("value", ["1.0", None, True, False, [1.0], {"x": 1.0}, math.nan, math.inf, -math.inf])
def test_what_is_no_number_is_refused_by_the_name_of_its_field(value: Any) -> None:
    with pytest.raises(OutOfRange, match=r"linear\.x") as refused:
        SafetyEnvelope((), TWIST).shaped({"linear": {"x": value}}, 1.0, 0.0)
    assert refused.value.code in REASONS


@pytest.mark.parametrize("linear", [1.0, "x", None, [0.5, 0.5]])
def test_a_number_cannot_be_inside_something_that_is_no_object(linear: Any) -> None:
    with pytest.raises(OutOfRange, match=rf"linear\.x.*in a {type(linear).__name__}$"):
        SafetyEnvelope((), TWIST).shaped({"linear": linear}, 1.0, 0.0)


def test_a_refused_message_leaves_the_envelope_as_it_was() -> None:
    envelope = SafetyEnvelope([FieldLimit(("a", "b"), None, None, 1.0, 1.0, 1.0)])
    envelope.shaped({"a": 1.0, "b": 1.0}, 1.0, 0.0)
    before = envelope.state
    with pytest.raises(OutOfRange):
        envelope.shaped({"a": 0.0, "b": "x"}, 1.0, 0.1)
    assert envelope.state == before


@pytest.mark.parametrize("huge", [10**400, -(10**400), 1.7e308, -1.7e308])
def test_huge_numbers_are_limited_like_any_other(huge: float) -> None:
    envelope = SafetyEnvelope([FieldLimit(("x", "y"), -3.0, 3.0, 1.0, 100.0, 100.0)])
    message = envelope.shaped({"x": huge, "y": huge}, 1.0, 0.0).message
    assert math.hypot(message["x"], message["y"]) == pytest.approx(1.0)


def test_an_integer_that_no_float_can_tell_is_not_limited() -> None:
    shaped = SafetyEnvelope((), TWIST).shaped({"linear": {"x": 2**53 + 1}}, 1.0, 0.0)
    assert (shaped.message, shaped.was_limited) == ({"linear": {"x": 2**53 + 1}}, False)


@pytest.mark.parametrize("factor", [math.nan, -0.1, 1.1, math.inf])
def test_a_factor_that_makes_no_sense_stops(factor: float) -> None:
    assert SafetyEnvelope((), TWIST).shaped(twist(1.0), factor, 0.0).is_zero


# -- idle


def rest(envelope: SafetyEnvelope, start_s: float, count: int, message: dict[str, Any] | None = None) -> list[bool]:
    message = twist() if message is None else message
    return [envelope.shaped(message, 1.0, start_s + tick * 0.25).is_idle for tick in range(count)]


def test_zeros_are_handed_on_for_a_second_and_then_the_operator_rests() -> None:
    assert rest(SafetyEnvelope((), TWIST), 0.0, 7) == [False] * 4 + [True] * 3


def test_idle_begins_when_the_base_stands_not_when_zero_is_wished() -> None:
    envelope = SafetyEnvelope([FieldLimit(("linear.x",), None, None, None, None, 1.0)], TWIST)
    envelope.shaped(twist(1.0), 1.0, 0.0)
    assert rest(envelope, 0.25, 8) == [False] * 7 + [True], "0.25 … 1.0 slewing, 1.0 … 2.0 standing"


def test_the_first_motion_after_resting_acts_at_once_and_rest_begins_anew() -> None:
    envelope = SafetyEnvelope((), TWIST)
    rest(envelope, 0.0, 8)
    shaped = envelope.shaped(twist(0.5), 1.0, 2.0)
    assert (shaped.is_idle, shaped.message) == (False, twist(0.5))
    assert rest(envelope, 2.25, 5) == [False] * 4 + [True]


def test_a_factor_of_zero_makes_a_driving_operator_stand_and_then_rest() -> None:
    envelope = SafetyEnvelope((), TWIST)
    shaped = [envelope.shaped(twist(1.0), 0.0, tick * 0.5) for tick in range(4)]
    assert [one.is_idle for one in shaped] == [False, False, True, True]
    assert all(one.is_zero for one in shaped)


def test_while_resting_a_change_of_something_else_is_handed_on() -> None:
    envelope = SafetyEnvelope((), TWIST)
    rest(envelope, 0.0, 8)
    lit = twist() | {"light": True}
    assert not envelope.shaped(lit, 1.0, 2.0).is_idle
    assert envelope.shaped(lit, 1.0, 2.25).is_idle


def test_without_motion_fields_nothing_is_ever_idle() -> None:
    envelope = SafetyEnvelope()
    assert rest(envelope, 0.0, 10, {"text": "hello"}) == [False] * 10


def test_after_a_safe_action_a_rest_is_told_again_for_a_second() -> None:
    envelope = SafetyEnvelope((), TWIST)
    rest(envelope, 0.0, 8)
    envelope.stand_still()
    assert rest(envelope, 2.0, 5) == [False] * 4 + [True]


def test_zero_makes_a_message_a_standstill_and_keeps_the_rest() -> None:
    envelope = SafetyEnvelope((), TWIST)
    assert envelope.zero({"linear": {"x": 2.0, "frame": "base"}, "light": 1}) == {
        "linear": {"x": 0.0, "frame": "base"},
        "light": 1,
    }


def test_a_standstill_too_is_refused_by_the_name_of_what_is_no_number() -> None:
    with pytest.raises(OutOfRange, match=r"linear\.x is no number but a str"):
        SafetyEnvelope((), TWIST).zero({"linear": {"x": "fast"}})


# -- properties

NUMBERS = st.one_of(st.floats(-3, 3), st.just(0.0), st.floats(allow_nan=False, allow_infinity=False))
RATES = st.one_of(st.none(), st.floats(0.01, 50))
FACTORS = st.one_of(st.just(1.0), st.floats(0, 1))
STEPS = st.one_of(st.floats(0, 0.2), st.floats(0, 10), st.just(0.0))
COMMANDS = st.lists(st.tuples(st.tuples(NUMBERS, NUMBERS), FACTORS, STEPS), min_size=1, max_size=30)


def walked(envelope: SafetyEnvelope, commands: list[Any]) -> list[tuple[float, float, float, float]]:
    """``(seconds since the one before, x, y, factor)`` of everything put out."""
    now_s, out = 5.0, []
    for (x, y), factor, step_s in commands:
        now_s += step_s
        message = envelope.shaped({"v": {"x": x, "y": y}}, factor, now_s).message
        out.append((step_s, message["v"]["x"], message["v"]["y"], factor))
    return out


@given(st.floats(-5, 0), st.floats(0, 5), st.floats(0, 5), RATES, RATES, COMMANDS)
def test_what_comes_out_is_always_inside_the_limits(
    low: float, high: float, norm: float, rise: float | None, fall: float | None, commands: list[Any]
) -> None:
    envelope = SafetyEnvelope([FieldLimit(("v.x", "v.y"), low, high, norm, rise, fall)])
    for _, x, y, _ in walked(envelope, commands):
        assert low <= x <= high
        assert low <= y <= high
        assert math.hypot(x, y) <= norm * (1 + 1e-12)


@given(st.floats(0.01, 20), st.floats(0.01, 20), COMMANDS)
def test_between_two_outputs_it_never_changes_faster_than_allowed(
    rise: float, fall: float, commands: list[Any]
) -> None:
    envelope = SafetyEnvelope([FieldLimit(("v.x", "v.y"), -3.0, 3.0, 4.0, rise, fall)])
    last_x = last_y = 0.0
    for number, (step_s, x, y, _) in enumerate(walked(envelope, commands)):
        risen_s = MAX_RISE_STEP_S if number == 0 else min(step_s, MAX_RISE_STEP_S)
        fallen_s = MAX_RISE_STEP_S if number == 0 else step_s
        change = math.hypot(x, y) - math.hypot(last_x, last_y)
        assert change <= rise * risen_s + 1e-9
        assert -change <= fall * fallen_s + 1e-9
        assert math.hypot(x - last_x, y - last_y) <= rise * risen_s + fall * fallen_s + 1e-9
        last_x, last_y = x, y


@given(st.floats(0.01, 20), st.floats(0.01, 20), COMMANDS)
def test_a_single_field_rises_and_falls_with_its_own_rates(rise: float, fall: float, commands: list[Any]) -> None:
    envelope = SafetyEnvelope([FieldLimit(("v.x",), -3.0, 3.0, None, rise, fall)])
    last = 0.0
    for number, (step_s, x, _, _) in enumerate(walked(envelope, commands)):
        elapsed_s = MAX_RISE_STEP_S if number == 0 else step_s
        if x * last < 0:
            assert abs(last) / fall + abs(x) / rise <= elapsed_s + 1e-9, "to zero first, then beyond"
        elif abs(x) > abs(last):
            assert abs(x) - abs(last) <= rise * min(elapsed_s, MAX_RISE_STEP_S) + 1e-9
        else:
            assert abs(last) - abs(x) <= fall * elapsed_s + 1e-9
        last = x


@given(RATES, RATES, st.one_of(st.none(), st.floats(0, 5)), COMMANDS)
def test_finite_in_means_finite_out(rise: float | None, fall: float | None, norm: float | None, commands: Any) -> None:
    envelope = SafetyEnvelope([FieldLimit(("v.x", "v.y"), None, None, norm, rise, fall)], ("v.x",))
    assert all(math.isfinite(number) for row in walked(envelope, commands) for number in row)


@given(COMMANDS)
def test_zero_stays_zero_without_a_limit_of_falling(commands: list[Any]) -> None:
    envelope = SafetyEnvelope([FieldLimit(("v.x", "v.y"), -1.0, 1.0, 1.0, 2.0)])
    for (x, y), factor, _ in commands:
        envelope.shaped({"v": {"x": x, "y": y}}, factor, 5.0)
        shaped = envelope.shaped({"v": {"x": 0.0, "y": 0.0}}, factor, 5.0)
        assert (shaped.is_zero, shaped.was_limited) == (True, False)
        assert shaped.message == {"v": {"x": 0.0, "y": 0.0}}


@given(st.floats(-1, 1), st.floats(-1, 1), st.floats(0.01, 20))
def test_the_way_to_zero_holds_no_rise(x: float, y: float, fall: float) -> None:
    """However the vector lies, rounding must not keep the last bit of it moving."""
    envelope = SafetyEnvelope([FieldLimit(("v.x", "v.y"), None, None, None, 0.01, fall)])
    for tick in range(3):
        envelope.shaped({"v": {"x": x, "y": y}}, 1.0, tick * 0.1)
    length = math.hypot(*envelope.state.output)
    assert envelope.shaped({"v": {"x": 0.0, "y": 0.0}}, 1.0, 0.2 + length / fall + 1e-6).is_zero


@given(st.floats(-100, 100), st.floats(-100, 100), st.floats(0.01, 5), FACTORS)
def test_a_clamped_vector_keeps_its_direction(x: float, y: float, norm: float, factor: float) -> None:
    envelope = SafetyEnvelope([FieldLimit(("v.x", "v.y"), None, None, norm)])
    [(_, new_x, new_y, _)] = walked(envelope, [((x, y), factor, 0.0)])
    assert new_x * y == pytest.approx(new_y * x, rel=1e-9, abs=1e-9)
    assert new_x * x >= 0
    assert new_y * y >= 0
    assert math.hypot(new_x, new_y) == pytest.approx(factor * min(norm, math.hypot(x, y)), rel=1e-9, abs=1e-9)


@given(st.floats(0.2, 20), st.floats(0.2, 20), st.floats(-2, 2), st.floats(-2, 2))
@settings(max_examples=50)
def test_who_keeps_wishing_gets_there(rise: float, fall: float, x: float, y: float) -> None:
    envelope = SafetyEnvelope([FieldLimit(("v.x", "v.y"), None, None, None, rise, fall)])
    envelope.shaped({"v": {"x": -1.0, "y": 1.0}}, 1.0, 0.0)
    ticks = int((2.0 / fall + 3.0 / rise) / 0.05) + 5
    for tick in range(ticks):
        message = envelope.shaped({"v": {"x": x, "y": y}}, 1.0, tick * 0.05).message
    assert message == {"v": {"x": x + 0.0, "y": y + 0.0}}, "exactly, not only nearly"


JSON: st.SearchStrategy[Any] = st.recursive(
    st.one_of(st.none(), st.booleans(), st.integers(-(10**320), 10**320), st.floats(), st.text(max_size=3)),
    lambda inner: st.one_of(
        st.lists(inner, max_size=3), st.dictionaries(st.sampled_from(["v", "x", "y", "w", ""]), inner, max_size=4)
    ),
    max_leaves=8,
)


@settings(max_examples=300)
@given(st.lists(st.tuples(st.dictionaries(st.sampled_from(["v", "x", "w"]), JSON), st.floats(), st.floats(-1e9, 1e9))))
def test_any_json_is_shaped_inside_the_limits_or_refused_and_never_changed_in_place(walk: list[Any]) -> None:
    envelope = SafetyEnvelope([FieldLimit(("v.x", "w"), -1.0, 2.0, 1.5, 3.0, 3.0)], ("v.y",))
    for message, factor, now_s in walk:
        before = copy.deepcopy(message)
        try:
            out = envelope.shaped(message, factor, now_s).message
        except OutOfRange:
            continue
        finally:
            assert repr(message) == repr(before)
        for value in (out.get("v", {}).get("x", 0.0), out.get("w", 0.0)):
            assert -1.0 <= value <= 1.5
        assert out.keys() >= message.keys()


def test_idle_after_is_a_second() -> None:
    assert IDLE_AFTER_S == 1.0
