"""Operators from elsewhere hear where the robot serves its own network; those who came by it need not."""

from __future__ import annotations

from dataclasses import dataclass, field

from mosaic_core.contract.host import Sender
from mosaic_core.runtime.peers.near_path import MAX_URLS, NearPath
from mosaic_core.words.control import ControlMessage, Near

URLS = ("http://10.0.0.7:9002", "http://rover.local:9002")


@dataclass(eq=False)
class Operator:
    peer_id: str
    knows_near: bool = True
    heard: list[ControlMessage] = field(default_factory=list)

    @property
    def sender(self) -> Sender:
        return Sender(self.peer_id, "", "", "", "operator")

    def answer(self, message: ControlMessage) -> None:
        self.heard.append(message)


def near_path() -> NearPath:
    return NearPath(lambda peer_id: peer_id.startswith("lan:"))


def test_who_comes_later_hears_what_is_known_and_everybody_hears_of_changes() -> None:
    path, early, late = near_path(), Operator("fleet:1"), Operator("fleet:2")
    path.joined(early)
    assert early.heard == []
    path.changed(URLS)
    path.joined(late)
    path.changed(URLS)
    path.changed(())
    assert early.heard == late.heard == [Near(urls=URLS), Near(urls=())]


def test_neither_who_is_near_nor_who_knows_no_such_word_is_told() -> None:
    path, near, old = near_path(), Operator("lan:1"), Operator("fleet:1", knows_near=False)
    for one in (near, old):
        path.joined(one)
    path.changed(URLS)
    assert near.heard == old.heard == []


def test_who_has_left_hears_nothing_more_and_joining_twice_is_joining_once() -> None:
    path, one = near_path(), Operator("fleet:1")
    path.joined(one)
    path.joined(one)
    path.changed(URLS)
    path.left(one)
    path.left(one)
    path.changed(())
    assert one.heard == [Near(urls=URLS)]


def test_a_machine_with_very_many_addresses_tells_some() -> None:
    path, one = near_path(), Operator("fleet:1")
    path.joined(one)
    path.changed([f"http://10.0.0.{number}" for number in range(99)])
    [told] = one.heard
    assert isinstance(told, Near)
    assert len(told.urls) == MAX_URLS
