"""Positions in a list move from where each is, within its own range and at its own rate, whoever is named."""

from __future__ import annotations

import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.commands.message_numbers import OutOfRange
from mosaic_core.machines.commands.number_list import MAX_NUMBERS, NumberList
from mosaic_core.machines.commands.position_slew import PAUSE_S, PositionUnknown, SaidInPart
from mosaic_core.machines.commands.safety_envelope import SafetyEnvelope
from mosaic_core.machines.commands.slew import MAX_RISE_STEP_S
from mosaic_core.words.limits import FieldLimit, ImpossibleLimit

JOINTS = NumberList("positions", "names")
PLAIN = NumberList("positions")


def limit(joint: str, low: float | None = None, high: float | None = None, rate: float | None = None) -> FieldLimit:
    return FieldLimit((f"positions.{joint}",), low, high, max_rate_per_s=rate, kind="position")


class Arm:
    """Joints with an envelope. ``is_at``: what their sensors say, by name."""

    def __init__(self, *limits: FieldLimit, its: NumberList = JOINTS, **is_at: float) -> None:
        self.is_at = is_at
        self.asked: list[str] = []
        self.envelope = SafetyEnvelope(limits, (), (its.every,), lists=(its,), report=self._report)

    def _report(self, field: str) -> float | None:
        self.asked.append(field)
        return self.is_at.get(field.removeprefix("positions."))

    def sent(self, now_s: float, factor: float = 1.0, **goals: float) -> dict[str, float]:
        message = {"names": [*goals], "positions": [*goals.values()]}
        shaped = self.envelope.shaped(message, factor, now_s).message
        return dict(zip(shaped["names"], shaped["positions"], strict=True))


def test_each_joint_has_its_own_limits_and_all_others_those_of_the_star() -> None:
    arm = Arm(limit("*", -2, 2), limit("elbow", 0, 1))
    assert arm.sent(0.0, shoulder=9, elbow=9, wrist=-9) == {"shoulder": 2, "elbow": 1, "wrist": -2}
    assert arm.sent(0.1, elbow=-9) == {"elbow": 0}


def test_a_joint_that_no_limit_is_of_goes_where_it_is_told_as_it_was_written() -> None:
    arm = Arm(limit("elbow", 0, 1))
    shaped = arm.envelope.shaped({"names": ["a", "elbow"], "positions": [7, 5]}, 1.0, 0.0)
    assert [*map(repr, shaped.message["positions"])] == ["7", "1"]
    assert shaped.was_limited
    assert shaped.wants_motion


def test_a_rate_begins_where_each_joint_is_and_never_at_zero() -> None:
    arm = Arm(limit("*", rate=1.0), shoulder=1.5, elbow=-1.0)
    assert arm.sent(0.0, shoulder=-1.5, elbow=-1.0) == {"shoulder": pytest.approx(1.4), "elbow": -1.0}
    assert arm.asked == ["positions.shoulder", "positions.elbow"]
    assert arm.sent(0.05, shoulder=-1.5) == {"shoulder": pytest.approx(1.35)}, "in between nobody is asked"
    assert arm.asked == ["positions.shoulder", "positions.elbow"]


def test_after_a_safe_action_every_joint_begins_where_it_is_then() -> None:
    arm = Arm(limit("*", rate=1.0), shoulder=1.5)
    arm.sent(0.0, shoulder=1.5)
    arm.envelope.stand_still()
    arm.is_at["shoulder"] = 0.5
    assert arm.sent(0.2, shoulder=1.5) == {"shoulder": pytest.approx(0.6)}


def test_a_joint_of_which_nobody_knows_where_it_is_is_refused_and_named() -> None:
    with pytest.raises(PositionUnknown, match=r"positions\.elbow"):
        Arm(limit("*", rate=1.0), shoulder=0.0).sent(0.0, shoulder=0.0, elbow=0.0)


def test_a_factor_scales_the_rate_and_no_position() -> None:
    arm = Arm(limit("*", rate=1.0), shoulder=1.0)
    assert arm.sent(0.0, 0.5, shoulder=2.0) == {"shoulder": pytest.approx(1.05)}
    assert arm.sent(0.1, 0.0, shoulder=2.0) == {"shoulder": pytest.approx(1.05)}


def test_with_nothing_left_a_joint_without_any_limit_stays_where_it_is() -> None:
    assert Arm(shoulder=1.0).sent(0.0, 0.0, shoulder=2.0) == {"shoulder": 1.0}


def test_a_list_without_names_goes_by_index() -> None:
    arm = Arm(limit("*", high=2), limit("1", high=1), its=PLAIN)
    assert arm.envelope.shaped({"positions": [9, 9, 9]}, 1.0, 0.0).message == {"positions": [2, 1, 2]}
    assert PLAIN.could_hold("positions.12")
    assert not PLAIN.could_hold("positions.elbow")


def test_joints_that_are_limited_together_are_said_together() -> None:
    both = FieldLimit(("positions.x", "positions.y"), max_norm=1.0, kind="position")
    assert Arm(both).sent(0.0, y=3.0, x=4.0) == {"x": pytest.approx(0.8), "y": pytest.approx(0.6)}
    with pytest.raises(SaidInPart, match=r"positions\.x and positions\.y are limited together"):
        Arm(both).sent(0.0, x=1.0)


def test_no_vector_is_made_of_a_star() -> None:
    with pytest.raises(ImpossibleLimit, match="named one by one"):
        FieldLimit(("positions.*", "positions.x"), max_norm=1.0, kind="position")


def test_a_list_inside_the_message_is_read_and_written_and_the_original_stays() -> None:
    its = NumberList("arm.q", "arm.names")
    message = {"arm": {"q": [5.0], "names": ["a"]}, "more": 1}
    envelope = SafetyEnvelope([FieldLimit(("arm.q.a",), 0, 1, kind="position")], lists=(its,))
    assert envelope.shaped(message, 1.0, 0.0).message == {"arm": {"q": [1], "names": ["a"]}, "more": 1}
    assert message["arm"] == {"q": [5.0], "names": ["a"]}


def test_a_message_without_the_list_moves_nothing() -> None:
    shaped = Arm(limit("*", 0, 1)).envelope.shaped({"duration_s": 1}, 1.0, 0.0)
    assert (shaped.message, shaped.wants_motion) == ({"duration_s": 1}, False)


WRONG: list[tuple[Any, Any, str]] = [
    (["a"], [math.nan], "positions.a is not finite"),
    (["a"], [math.inf], "positions.a is not finite"),
    (["a"], ["1"], "positions.a is no number but a str"),
    (["a"], [None], "positions.a is no number but a NoneType"),
    (["a"], [True], "positions.a is no number but a bool"),
    (["a"], [[1.0]], "positions.a is no number but a list"),
    (["a"], 1.0, "positions is no list but a float"),
    (["a"], None, "positions is no list but a NoneType"),
    (["a", "b"], [1.0], "positions has 1 value for 2 names"),
    ([], [1.0], "positions has 1 value for 0 names"),
    (["a", "a"], [1.0, 2.0], "names has a name twice"),
    ([1], [1.0], "names is no list of texts"),
    ("a", [1.0], "names is no list of texts"),
    (["a"] * (MAX_NUMBERS + 1), [1.0] * (MAX_NUMBERS + 1), "positions has 1025 numbers, and 1024 are the most"),
]


@pytest.mark.parametrize(("names", "positions", "words"), WRONG)
def test_a_list_that_says_no_positions_is_refused(names: Any, positions: Any, words: str) -> None:
    with pytest.raises(OutOfRange) as refused:
        Arm(limit("*", 0, 1)).envelope.shaped({"names": names, "positions": positions}, 1.0, 0.0)
    assert refused.value.message == words


@pytest.mark.parametrize(
    ("beside", "told"), [({}, ""), ({"nmaes": ["a"]}, ": it has 'nmaes' instead"), ({"joints": ["a"]}, "")]
)
def test_without_names_a_list_that_needs_them_is_refused_with_the_key_that_was_meant(
    beside: dict[str, Any], told: str
) -> None:
    with pytest.raises(OutOfRange) as refused:
        Arm().envelope.shaped({"positions": [1.0], **beside}, 1.0, 0.0)
    assert refused.value.message == f"'names', which names positions, is missing{told}"


def test_names_deep_in_a_message_are_looked_for_where_they_belong() -> None:
    its = NumberList("arm.positions", "arm.names")
    with pytest.raises(
        OutOfRange, match=r"'arm\.names', which names arm\.positions, is missing: it has 'name' instead"
    ):
        its.read({"names": ["a"], "arm": {"positions": [1.0], "name": ["a"]}})


def test_a_joint_that_the_arm_does_not_have_is_refused_where_its_joints_are_known() -> None:
    its = NumberList("positions", "names", frozenset({"elbow", "wrist"}))
    with pytest.raises(OutOfRange, match=r"names: there is no 'elbo'; did you mean 'elbow'\? There are: elbow, wrist"):
        Arm(its=its).sent(0.0, elbo=1.0)
    assert its.could_hold("positions.elbow")
    assert not its.could_hold("positions.elbo")


def test_names_that_somebody_makes_up_fill_no_memory_and_free_no_joint() -> None:
    arm = Arm(limit("*", rate=1.0))
    for first in range(0, MAX_NUMBERS, 256):
        arm.is_at = {str(number): 0.0 for number in range(first, first + 256)}
        arm.sent(0.0, **{str(number): 1.0 for number in range(first, first + 256)})
    arm.is_at = {"further": 0.0}
    with pytest.raises(OutOfRange, match="more than 1024 positions of lists were commanded within 1 s"):
        arm.sent(0.5, further=1.0)
    assert arm.sent(0.5, **{"0": 1.0}) == {"0": pytest.approx(0.2)}, "what was sent just now is not forgotten"
    assert arm.sent(PAUSE_S, further=1.0) == {"further": pytest.approx(0.1)}


joints = st.sampled_from(["a", "b", "c"])
places = st.floats(-3, 3)
steps = st.lists(
    st.one_of(
        st.tuples(st.just("command"), st.dictionaries(joints, places, min_size=1), st.floats(0, 1)),
        st.tuples(st.just("safe"), st.dictionaries(joints, places), st.just(1.0)),
    ),
    max_size=30,
)


@given(steps=steps, start=st.fixed_dictionaries({"a": places, "b": places, "c": places}), waits=st.data())
def test_a_joint_never_moves_faster_than_its_rate_and_never_out_of_its_range(
    steps: Any, start: dict[str, float], waits: st.DataObject
) -> None:
    """Whatever stops, time-outs and pauses there are, and wherever a hand puts it meanwhile."""
    low, high = {"a": -1.0, "b": 0.5, "c": -1.0}, {"a": 1.0, "b": 1.5, "c": 1.0}
    rate = {"a": 1.0, "b": 0.3, "c": 1.0}
    arm = Arm(limit("*", -1, 1, 1.0), limit("b", 0.5, 1.5, 0.3), **start)
    at = dict(start)
    now_s, sent_at_s = 0.0, dict.fromkeys(at, -math.inf)
    for what, said, factor in steps:
        wait_s = waits.draw(st.floats(0, 2))
        now_s += wait_s
        if what == "safe":
            arm.envelope.stand_still()
            at.update(said)
            arm.is_at = dict(at)
            continue
        for name, value in arm.sent(now_s, factor, **said).items():
            step = rate[name] * factor * min(now_s - sent_at_s[name], MAX_RISE_STEP_S)
            assert abs(value - at[name]) <= step + 1e-9
            before, after = (max(low[name] - where, where - high[name], 0.0) for where in (at[name], value))
            assert after <= before + 1e-9, "from outside it moves inwards, from inside not out"
            at[name], sent_at_s[name] = value, now_s
        arm.is_at = dict(at)
