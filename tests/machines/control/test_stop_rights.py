"""A supervisor takes from one observer the right to say stop; nobody else loses it, nobody else gives it back."""

from __future__ import annotations

import pytest

from mosaic_core.machines.control.lease_events import Party
from mosaic_core.machines.control.stop_rights import MAX_CHANGED, UNCHANGED, RightToStop, StopRights
from mosaic_core.words.control import Role

BOSS = Party("b", "sb", "Boss", role="supervisor", is_person=True)
WANDA = Party("w", "sw", role="observer", is_person=True)


def party(role: Role, *, is_original: bool = False) -> Party:
    return Party("x", "sx", role=role, is_original=is_original)


def test_an_observer_loses_the_right_and_gets_it_back_from_a_supervisor_alone() -> None:
    rights = StopRights()
    assert rights.right(WANDA, "wanda").may_stop
    assert rights.change(BOSS, WANDA, "wanda", False) is None
    assert not rights.right(WANDA, "wanda").may_stop
    assert not rights.right(Party("w2", "s2", role="observer"), "wanda").may_stop, "a new connection gives nothing back"
    assert rights.right(WANDA, "another").may_stop
    assert rights.change(BOSS, WANDA, "wanda", True) is None
    assert rights.right(WANDA, "wanda").may_stop


@pytest.mark.parametrize("by", [party("operator"), party("observer"), party("supervisor", is_original=True), WANDA])
@pytest.mark.parametrize("may_stop", [False, True])
def test_nobody_but_a_supervisor_changes_it(by: Party, may_stop: bool) -> None:
    rights = StopRights()
    rights.change(BOSS, WANDA, "wanda", may_stop)
    assert rights.change(by, WANDA, "wanda", not may_stop) == "auth.forbidden"
    assert rights.right(WANDA, "wanda").may_stop == may_stop


@pytest.mark.parametrize("role", ["operator", "supervisor"])
def test_operators_and_supervisors_always_say_stop(role: Role) -> None:
    rights = StopRights()
    assert rights.change(BOSS, party(role), "x", False) == "safety.always_stops"
    rights.change(BOSS, WANDA, "x", False)
    assert rights.right(party(role), "x").may_stop, "also one who was an observer before"


def test_the_robot_remembers_a_bounded_number_and_gives_it_back_to_the_first() -> None:
    rights = StopRights()
    for number in range(MAX_CHANGED + 1):
        rights.change(BOSS, WANDA, f"{number}", False)
    may = [rights.right(WANDA, f"{number}").may_stop for number in range(MAX_CHANGED + 1)]
    assert may == [True] + [False] * MAX_CHANGED


def test_it_is_known_who_changed_the_right_last() -> None:
    rights = StopRights()
    assert rights.right(WANDA, "wanda") == UNCHANGED
    rights.change(BOSS, WANDA, "wanda", False)
    assert rights.right(WANDA, "wanda") == RightToStop(False, "Boss")
    rights.change(Party("c", "sc", role="supervisor"), WANDA, "wanda", True)
    assert rights.right(WANDA, "wanda") == RightToStop(True, "c"), "a peer id, where there is no name"
    assert rights.right(party("operator"), "wanda") == UNCHANGED


def test_whose_right_was_changed_anew_is_forgotten_last() -> None:
    rights = StopRights()
    for number in (*range(MAX_CHANGED), 0, MAX_CHANGED):
        rights.change(BOSS, WANDA, f"{number}", False)
    assert not rights.right(WANDA, "0").may_stop
    assert rights.right(WANDA, "1").may_stop
