"""A robot's places: nobody has them all, whoever doesn't connect gives his up, and a supervisor always finds one."""

from __future__ import annotations

from itertools import count

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.signaling.robot_places import HALF_OPEN_S, OFFERS_HZ, Comer, NoPlace, RobotPlaces
from mosaic_core.words.control import Role

COUNT = 16
_numbers = count()


def comer(account: str, role: Role = "operator", session: str = "") -> Comer:
    peer_id = f"p{next(_numbers)}"
    return Comer(peer_id, account, session or peer_id, role)


def connect(places: RobotPlaces, who: Comer, now_s: float = 0.0) -> tuple[str, ...]:
    left = places.take(who, now_s)
    places.connected(who.peer_id)
    return left


def full_of_connected(ordinary: int = COUNT - 1) -> RobotPlaces:
    places = RobotPlaces(COUNT)
    for number in range(ordinary):
        connect(places, comer(f"account {number}"))
    return places


def test_one_account_that_offers_without_end_and_never_connects_keeps_half_the_places_at_most() -> None:
    places, greedy = RobotPlaces(COUNT), 0
    for step in range(1000):
        places.take(comer("mallory"), step / OFFERS_HZ)
        greedy = max(greedy, len(places))
    assert greedy == COUNT // 2
    assert connect(places, comer("alice"), 1000.0) == ()


def test_offers_that_come_faster_are_refused() -> None:
    places = RobotPlaces(COUNT)
    for _ in range(COUNT):
        places.take(comer("mallory"), 0.0)
    with pytest.raises(NoPlace) as refused:
        places.take(comer("mallory"), 0.1)
    assert refused.value.code == "signal.too_slow"
    places.take(comer("alice"), 0.1)


def test_an_account_with_its_share_of_live_connections_is_told_so() -> None:
    places = RobotPlaces(COUNT)
    for _ in range(COUNT // 2):
        connect(places, comer("mallory"))
    with pytest.raises(NoPlace, match="this account already has 8 of the robot's 16 places"):
        places.take(comer("mallory"), 0.0)


def test_a_session_that_comes_back_takes_its_own_place_where_there_is_no_other() -> None:
    places = RobotPlaces(COUNT)
    mine = [comer("alice", session=f"s{number}") for number in range(COUNT // 2)]
    for one in mine:
        connect(places, one)
    assert places.take(comer("alice", session="s3"), 9.0) == (mine[3].peer_id,)


def test_the_last_place_is_for_a_supervisor() -> None:
    places = full_of_connected()
    with pytest.raises(NoPlace, match="the robot already has 15 operators"):
        places.take(comer("bob"), 0.0)
    assert connect(places, comer("carla", "supervisor")) == ()
    assert places.is_full


def test_supervisors_take_nobody_elses_place_by_having_one() -> None:
    places = RobotPlaces(COUNT)
    connect(places, comer("carla", "supervisor"))
    for number in range(COUNT - 1):
        connect(places, comer(f"account {number}"))
    assert places.is_full


def test_a_connection_being_set_up_leaves_for_another_when_it_takes_too_long() -> None:
    places = full_of_connected(COUNT - 2)
    slow = comer("slow")
    places.take(slow, 0.0)
    with pytest.raises(NoPlace):
        places.take(comer("bob"), HALF_OPEN_S)
    assert places.take(comer("bob"), HALF_OPEN_S + 1) == (slow.peer_id,)


def test_who_has_most_places_leaves_first_and_at_once() -> None:
    places = full_of_connected(8)
    modest = comer("modest")
    places.take(modest, 0.0)
    greedy = [comer("mallory") for _ in range(6)]
    for one in greedy:
        places.take(one, 0.1)
    assert places.take(comer("bob"), 0.2) == (greedy[0].peer_id,)


def test_nobody_leaves_a_place_where_he_is_connected_for_a_stranger() -> None:
    places = full_of_connected()
    before = set(places.phases)
    for number in range(50):
        with pytest.raises(NoPlace):
            places.take(comer(f"stranger {number}"), 1000.0)
    assert set(places.phases) == before


def test_operators_of_a_server_without_tickets_share_nothing_but_the_rate() -> None:
    places = RobotPlaces(COUNT)
    for number in range(COUNT - 1):
        assert connect(places, comer(""), float(number)) == ()


STEPS = st.lists(
    st.tuples(
        st.sampled_from(["mallory", "alice", "bob", "carla", ""]),
        st.sampled_from(["observer", "operator", "supervisor"]),
        st.sampled_from(["offer", "connect", "leave"]),
        st.floats(0, 4),
    ),
    max_size=120,
)


@given(STEPS)
def test_whatever_comes_places_are_counted_and_the_connected_stay(steps: list[tuple[str, Role, str, float]]) -> None:
    places, now_s, alive = RobotPlaces(COUNT), 0.0, dict[str, Comer]()
    for account, role, what, pause_s in steps:
        now_s += pause_s
        if what == "offer":
            who, connected = comer(account, role), {one for one, phase in places.phases.items() if phase == "connected"}
            try:
                left = places.take(who, now_s)
            except NoPlace:
                assert who.peer_id not in places
                continue
            alive[who.peer_id] = who
            assert not connected & set(left)
            for gone in left:
                del alive[gone]
        elif alive and what == "connect":
            places.connected(next(reversed(alive)))
        elif alive:
            gone = next(iter(alive))
            assert places.leave(gone) is not None
            del alive[gone]
        assert set(places.phases) == set(alive)
        assert len(places) <= COUNT
        assert sum(one.role != "supervisor" for one in alive.values()) <= COUNT - 1
        assert all(sum(one.account == name for one in alive.values()) <= COUNT // 2 for name in ("mallory", "alice"))
