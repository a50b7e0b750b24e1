"""What an operator says about control, its coming and its going, reaches whom it concerns."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from mosaic_core.contract.host import Sender
from mosaic_core.runtime.peers.peer_control import PeerControl
from mosaic_core.runtime.peers.remote_operator import RemoteOperator
from mosaic_core.words import control
from mosaic_core.words.control import CONTROL_EXTENSIONS, Hello

LEASES = Hello(software="test", boot_id="b", extensions=CONTROL_EXTENSIONS)
NO_LEASES = Hello(software="test", boot_id="b", extensions={"near": 1})


class Calls:
    """Notes every call under ``name``."""

    def __init__(self, name: str, calls: list[tuple[Any, ...]]) -> None:
        self._name, self._calls = name, calls

    def __getattr__(self, method: str) -> Any:
        return lambda *arguments: self._calls.append((f"{self._name}.{method}", *arguments))


class Robot:
    """``calls``: who was told what."""

    def __init__(self, legacy_peers: str = "allow") -> None:
        self.calls: list[tuple[Any, ...]] = []
        self.link = Calls("link", self.calls)
        site: Any = SimpleNamespace(
            desk=Calls("desk", self.calls),
            near=Calls("near", self.calls),
            delivery=Calls("delivery", self.calls),
            links=SimpleNamespace(add=lambda peer_id: self.link, remove=Calls("links", self.calls).remove),
            media=SimpleNamespace(watched_by=lambda peer_id: {"front"} if peer_id == "p1" else set()),
            legacy_peers=legacy_peers,
        )
        self.operator = RemoteOperator(Sender("p1", "s1", "o1", "Ann"))
        self.control = PeerControl(self.operator, site)

    def hears(self, message: control.ControlMessage) -> list[tuple[Any, ...]]:
        self.calls.clear()
        self.control.control_heard(message)
        return [call[:-1] if isinstance(call[-1], float) else call for call in self.calls]


def test_only_the_link_of_who_knows_leases_is_measured() -> None:
    old, new = Robot(), Robot()
    old.control.said_hello(NO_LEASES)
    new.control.said_hello(LEASES)
    assert old.operator.link is None
    assert new.operator.link is new.link
    assert new.operator.knows_leases


@pytest.mark.parametrize(("legacy_peers", "is_taken"), [("allow", True), ("observe", True), ("refuse", False)])
def test_an_original_is_taken_where_the_robot_takes_any(legacy_peers: str, is_taken: bool) -> None:
    robot = Robot(legacy_peers)
    assert robot.control.treat_as_original() is is_taken
    assert robot.operator.sender.is_original
    joined = [("desk.peer_joined", robot.operator), ("near.operator_joined", robot.operator)]
    assert robot.calls == (joined if is_taken else [])


def test_who_leaves_leaves_everywhere_the_desk_last() -> None:
    robot = Robot()
    robot.control.operator_left("peer.lost")
    assert robot.calls == [
        ("links.remove", "p1"),
        ("near.operator_left", robot.operator),
        ("delivery.watch", robot.operator, False),
        ("desk.peer_left", robot.operator, "peer.lost"),
    ]


def test_a_stop_goes_to_the_desk_and_is_answered_where_it_was_heard() -> None:
    robot, stop = Robot(), control.Stop(id="a")
    assert robot.hears(stop) == [("desk.stop_heard", robot.operator, stop, robot.operator.answer)]
    robot.calls.clear()
    robot.control.control_heard(stop, print)
    [call] = robot.calls
    assert call[:4] == ("desk.stop_heard", robot.operator, stop, print)
    assert isinstance(call[4], float)


def test_what_measures_the_link_goes_there_once_there_is_one() -> None:
    robot = Robot()
    pong = control.Pong(t0=7, t1=8, t2=9)
    front, rear = (control.MediaSeen(label=label, capture_us=5) for label in ("front", "rear"))
    assert (robot.hears(pong), robot.hears(front)) == ([], [])
    robot.control.said_hello(LEASES)
    assert robot.hears(pong) == [("link.ponged", 7)]
    assert robot.hears(front) == [("link.picture_seen", "front", 5)]
    assert robot.hears(rear) == [], "it does not watch that one"


@pytest.mark.parametrize("on", [True, False])
def test_reports_about_delivery_are_for_who_wants_them(on: bool) -> None:
    robot = Robot()
    assert robot.hears(control.DeliveryWatch(on=on)) == [("delivery.watch", robot.operator, on)]


def test_everything_else_is_the_desks() -> None:
    robot, message = Robot(), control.LeaseRequest(resource="motion")
    assert robot.hears(message) == [("desk.control_heard", robot.operator, message)]
