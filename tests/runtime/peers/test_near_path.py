"""Operators from elsewhere hear where the robot serves its own network; those who came by it need not."""

from __future__ import annotations

from dataclasses import dataclass, field

from mosaic_core.runtime.peers.near_path import MAX_URLS, NearPath
from mosaic_core.words.control import ControlMessage, Near

URLS = ("http://10.0.0.7:9002", "http://rover.local:9002")


@dataclass(eq=False)
class Operator:
    wants_near: bool = True
    heard: list[ControlMessage] = field(default_factory=list)

    def answer(self, message: ControlMessage) -> None:
        self.heard.append(message)


def test_who_comes_later_hears_what_is_known_and_everybody_hears_of_changes() -> None:
    path, early, late = NearPath(), Operator(), Operator()
    path.operator_joined(early)
    assert early.heard == []
    path.urls_changed(URLS)
    path.operator_joined(late)
    path.urls_changed(URLS)
    path.urls_changed(())
    assert early.heard == late.heard == [Near(urls=URLS), Near(urls=())]


def test_who_does_not_want_to_know_is_not_told() -> None:
    path, other = NearPath(), Operator(wants_near=False)
    path.operator_joined(other)
    path.urls_changed(URLS)
    assert other.heard == []


def test_who_has_left_hears_nothing_more_and_joining_twice_is_joining_once() -> None:
    path, one = NearPath(), Operator()
    path.operator_joined(one)
    path.operator_joined(one)
    path.urls_changed(URLS)
    path.operator_left(one)
    path.operator_left(one)
    path.urls_changed(())
    assert one.heard == [Near(urls=URLS)]


def test_a_machine_with_very_many_addresses_tells_some() -> None:
    path, one = NearPath(), Operator()
    path.operator_joined(one)
    path.urls_changed([f"http://10.0.0.{number}" for number in range(99)])
    [told] = one.heard
    assert isinstance(told, Near)
    assert len(told.urls) == MAX_URLS
