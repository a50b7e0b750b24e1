"""A follower comes slowly, then follows, and is never sent leaping."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from mosaic_arm.commands.following import FAR_RAD, MAX_STEP_S, NEAR_RAD, Following

angles = st.fixed_dictionaries({"a": st.floats(-3, 3), "b": st.floats(-3, 3)})


def test_nothing_is_said_while_nobody_knows_where_the_follower_is() -> None:
    following = Following(0.4)
    assert following.target({"a": 1.0}, None, 0.01) is None
    assert following.phase == "waiting"


@given(angles, angles, st.floats(0, 10))
def test_the_first_steps_are_slow_wherever_the_leader_is(
    leader: dict[str, float], follower: dict[str, float], step_s: float
) -> None:
    following = Following(approach_radps=0.5)
    told = following.target(leader, follower, step_s)
    assert told is not None
    assert all(abs(told[name] - follower[name]) <= 0.5 * MAX_STEP_S + 1e-9 for name in told)


@given(angles, angles)
def test_a_follower_that_obeys_arrives_and_then_follows_exactly(
    leader: dict[str, float], follower: dict[str, float]
) -> None:
    following = Following(approach_radps=1.0)
    for _ in range(2000):
        told = following.target(leader, follower, 0.01)
        assert told is not None
        follower = told
    assert following.phase == "following"
    assert following.target(leader, follower, 0.01) == leader


def test_a_follower_that_does_not_move_is_never_taken_for_near() -> None:
    following = Following(approach_radps=1.0)
    for _ in range(1000):
        following.target({"a": 2.0}, {"a": 0.0}, 0.01)
    assert following.phase == "approaching"


def test_a_follower_that_was_left_behind_is_fetched_slowly() -> None:
    following = Following(0.4)
    following.target({"a": 0.0}, {"a": NEAR_RAD / 2}, 0.01)
    assert following.phase == "following"
    assert following.target({"a": FAR_RAD * 2}, {"a": 0.0}, 0.01) == {"a": 0.0}
    assert following.phase == "approaching"


def test_a_state_that_is_lost_begins_anew() -> None:
    following = Following(0.4)
    following.target({"a": 0.0}, {"a": 0.0}, 0.01)
    assert following.target({"a": 0.0}, None, 0.01) is None
    assert following.phase == "waiting"


def test_joints_that_only_one_has_are_left_out() -> None:
    assert Following(0.4).target({"a": 0.0, "x": 1.0}, {"a": 0.0, "y": 1.0}, 0.01) == {"a": 0.0}
