"""Who gets a place and a turn, decided without a socket."""

from __future__ import annotations

import logging

import pytest

from mosaic_server.entrance.places import EntrancePlace, Places
from mosaic_server.entrance.proxies import TrustedProxies, proxy_in
from mosaic_server.entrance.refusals import OTHERS, PERIOD_S, Refusals
from mosaic_server.entrance.request_pace import RequestPace


class Hall:
    """Places, and the connections that were closed to make room."""

    def __init__(self, per_address: int, in_all: int) -> None:
        self.places = Places(per_address, in_all)
        self.closed: list[str] = []

    def take(self, name: str, address: str | None, *, busy: bool = False) -> EntrancePlace | None:
        place = self.places.take(address)
        if place is not None:
            place.is_busy, place.close = busy, lambda: self.closed.append(name)
        return place


def test_the_oldest_idle_connection_of_an_address_makes_room_for_its_next() -> None:
    hall = Hall(per_address=2, in_all=10)
    hall.take("socket", "a", busy=True)
    hall.take("idle", "a")
    hall.take("stranger", "b")
    assert hall.take("newest", "a") is not None
    assert hall.closed == ["idle"]


def test_an_address_whose_connections_are_all_busy_gets_no_more_until_one_has_left() -> None:
    hall = Hall(per_address=2, in_all=10)
    first, _ = hall.take("first", "a", busy=True), hall.take("second", "a", busy=True)
    assert hall.take("third", "a") is None
    assert first is not None
    hall.places.leave(first)
    hall.places.leave(first)  # a second time it gives no second place
    assert hall.take("fourth", "a", busy=True) is not None
    assert hall.take("fifth", "a") is None
    assert hall.closed == []


def test_in_a_full_house_whoever_holds_most_makes_room() -> None:
    hall = Hall(per_address=3, in_all=4)
    hall.take("lonely", "b")
    for name in ("a1", "a2", "a3"):
        hall.take(name, "a")
    assert hall.take("new", "c") is not None
    assert hall.closed == ["a1"]


def test_a_proxy_speaks_for_many_and_counts_in_the_whole_alone() -> None:
    hall = Hall(per_address=1, in_all=3)
    assert all(hall.take("person", None, busy=True) for _ in range(3))
    assert hall.take("person", None) is None


def test_requests_of_one_address_take_turns_and_others_need_not_wait() -> None:
    pace = RequestPace(per_s=10.0, burst=2.0)
    assert [round(pace.wait_s("a", 5.0), 3) for _ in range(5)] == [0.0, 0.0, 0.1, 0.2, 0.3]
    assert pace.wait_s("b", 5.0) == 0.0
    assert round(pace.wait_s("a", 5.4), 3) == 0.0, "its debt is paid back, its credit is not"
    assert round(pace.wait_s("a", 9.0), 3) == 0.0


def test_a_refused_request_takes_no_turn() -> None:
    pace = RequestPace(per_s=10.0, burst=1.0)
    pace.wait_s("a", 0.0)
    for _ in range(100):
        assert round(pace.wait_s("a", 0.0), 3) == 0.1
        pace.left("a")


def test_refusals_are_told_at_once_and_then_once_a_minute(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.WARNING)
    refusals = Refusals()
    for now_s in range(50):
        refusals.note("a connection", "192.0.2.1", float(now_s))
        refusals.tick(float(now_s))
    assert caplog.messages == ["refused a connection from 192.0.2.1"]
    refusals.tick(PERIOD_S)
    assert caplog.messages[1:] == ["refused a connection from 192.0.2.1, 49 times more in 60 s"]
    refusals.tick(2 * PERIOD_S)
    refusals.note("a connection", "192.0.2.1", 2 * PERIOD_S)
    assert len(caplog.messages) == 3, "after a quiet minute it is news again"


def test_a_thousand_addresses_more_are_told_as_one(caplog: pytest.LogCaptureFixture) -> None:
    refusals = Refusals()
    for number in range(3000):
        refusals.note("a connection", f"192.0.{number // 250}.{number % 250}", 0.0)
    refusals.tick(PERIOD_S)
    assert len(caplog.messages) == 1000 + 1 + 1
    assert caplog.messages[-1].startswith(f"refused a connection from {OTHERS}, 1999 times")


@pytest.mark.parametrize(("text", "cure"), [("*", "write for example"), ("nginx", "for example"), ("", "for example")])
def test_what_is_no_address_is_no_proxy(text: str, cure: str) -> None:
    with pytest.raises(ValueError, match=cure):
        proxy_in(text)


def test_an_address_inside_of_a_network_is_answered_with_the_network() -> None:
    with pytest.raises(ValueError, match=r"write 10\.0\.0\.0/8"):
        proxy_in("10.1.2.3/8")


def test_named_proxies_are_known_by_address_and_network() -> None:
    proxies = TrustedProxies([proxy_in("127.0.0.1"), proxy_in("10.0.0.0/8"), proxy_in("2001:DB8::1")])
    assert all(one in proxies for one in ("127.0.0.1", "10.9.9.9", "2001:db8:0::1"))
    assert not any(one in proxies for one in ("127.0.0.2", "11.0.0.1", "2001:db8::2", "", "10.0.0.1, 127.0.0.1"))
