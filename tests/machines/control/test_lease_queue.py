"""Persons stand before programs, otherwise whoever came first; every session stands in a queue once."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mosaic_core.machines.control.lease_events import Party, Waiting
from mosaic_core.machines.control.lease_queue import MAX_WAITING, LeaseQueue

ANNA = Party("a", "sa", "Anna", is_person=True)
BEN = Party("b", "sb", "Ben", is_person=True)
PATROL = Party("p", "sp", "patrol")
MAPPER = Party("m", "sm", "mapper")


def queue_of(*waiting: Waiting) -> LeaseQueue:
    queue = LeaseQueue()
    for one in waiting:
        assert queue.add(one) is None
    return queue


def parties(queue: LeaseQueue) -> list[Party]:
    return [one.party for one in queue]


def test_the_first_is_who_is_next() -> None:
    assert LeaseQueue().first is None
    assert queue_of(Waiting(PATROL, "", 1.0), Waiting(MAPPER, "", 2.0), Waiting(ANNA, "", 3.0)).first == ANNA


def test_of_two_who_came_in_the_same_moment_the_first_said_goes_first() -> None:
    assert parties(queue_of(Waiting(BEN, "", 1.0), Waiting(ANNA, "", 1.0))) == [BEN, ANNA]


def test_who_waited_longer_elsewhere_in_the_queue_goes_before_who_came_later() -> None:
    assert parties(queue_of(Waiting(BEN, "", 2.0), Waiting(ANNA, "", 1.0))) == [ANNA, BEN]


def test_asking_again_under_another_peer_keeps_the_place_and_takes_the_new_reason() -> None:
    queue = queue_of(Waiting(ANNA, "first", 1.0), Waiting(BEN, "", 2.0))
    again = Party("a2", "sa", "Anna", is_person=True)
    assert queue.add(Waiting(again, "again", 3.0)) is None
    assert list(queue) == [Waiting(again, "again", 1.0), Waiting(BEN, "", 2.0)]


def test_a_full_queue_still_takes_who_stands_in_it() -> None:
    queue = full_of_programs()
    assert queue.add(Waiting(Party("p3", "s3"), "again", 99.0)) is None
    assert len(queue) == MAX_WAITING


def full_of_programs() -> LeaseQueue:
    return queue_of(*(Waiting(Party(f"p{number}", f"s{number}"), "", float(number)) for number in range(MAX_WAITING)))


def test_of_a_full_queue_the_last_program_makes_room_for_a_person_and_no_other() -> None:
    queue = full_of_programs()
    assert queue.add(Waiting(MAPPER, "", 99.0)) == MAPPER
    assert queue.add(Waiting(ANNA, "", 99.0)) == Party(f"p{MAX_WAITING - 1}", f"s{MAX_WAITING - 1}")
    assert parties(queue)[:2] == [ANNA, Party("p0", "s0")]
    assert len(queue) == MAX_WAITING


def test_in_a_full_queue_of_persons_the_one_program_makes_room_and_then_nobody() -> None:
    queue = LeaseQueue()
    for number in range(MAX_WAITING - 1):
        queue.add(Waiting(Party(f"a{number}", f"sa{number}", is_person=True), "", 0.1))
    queue.add(Waiting(PATROL, "", 0.2))
    assert queue.add(Waiting(ANNA, "", 0.3)) == PATROL
    assert queue.add(Waiting(BEN, "", 0.4)) == BEN, "persons make no room for each other"
    assert len(queue) == MAX_WAITING


def test_who_turns_out_to_be_a_person_moves_before_the_programs_with_its_reason_and_its_time() -> None:
    queue = queue_of(Waiting(PATROL, "round", 1.0), Waiting(MAPPER, "map", 2.0))
    mia = Party("m", "sm", "Mia", is_person=True)
    assert queue.update(mia)
    assert list(queue) == [Waiting(mia, "map", 2.0), Waiting(PATROL, "round", 1.0)]
    assert not queue.update(ANNA)


def test_a_peer_is_found_and_dropped_by_its_id_a_session_by_any_of_its_peers() -> None:
    queue = queue_of(Waiting(ANNA, "", 1.0), Waiting(PATROL, "", 2.0), Waiting(MAPPER, "", 3.0))
    assert (queue.find("p"), queue.find("x")) == (PATROL, None)
    assert queue.drop_peer("p")
    assert not queue.drop_peer("p")
    assert queue.drop_session(Party("a2", "sa"))
    assert not queue.drop_session(Party("a2", "sa"))
    assert parties(queue) == [MAPPER]


NUMBERS = st.integers(0, 40)
PARTIES = st.builds(
    lambda peer, session, is_person: Party(f"p{peer}", f"s{session}", is_person=is_person),
    *(NUMBERS, NUMBERS, st.booleans()),
)
TIMES = st.sampled_from([0.0, 1.0, 2.0])


@settings(max_examples=20)
@given(st.lists(st.tuples(st.sampled_from(["add", "update", "drop"]), PARTIES, TIMES), max_size=60))
def test_whatever_happens_nobody_is_overtaken_by_who_came_later(steps: list[tuple[str, Party, float]]) -> None:
    queue = LeaseQueue()
    for step, party, at_s in steps:
        match step:
            case "add":
                turned_away = queue.add(Waiting(party, "", at_s))
                assert (queue.find(party.peer_id) == party) == (turned_away != party)
            case "update":
                assert queue.update(party) == (queue.find(party.peer_id) is not None)
            case _:
                queue.drop_session(party)
                assert queue.find(party.peer_id) is None
        assert len(queue) <= MAX_WAITING
        ranks = [(not one.party.is_person, one.since_s) for one in queue]
        assert ranks == sorted(ranks)


@pytest.mark.parametrize("session_id", ["", "s"])
def test_only_a_named_session_is_one_on_two_peers(session_id: str) -> None:
    queue = queue_of(Waiting(Party("one", session_id), "", 1.0), Waiting(Party("two", session_id), "", 2.0))
    assert len(queue) == (1 if session_id else 2)
