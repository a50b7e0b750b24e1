"""Who is at the other end, as far as it has said, and what can be said to it when."""

from __future__ import annotations

from typing import Any

import pytest

from mosaic_core.contract.host import Sender
from mosaic_core.runtime.commands.link_watch import MeasuredLink
from mosaic_core.runtime.peers.remote_operator import ORDERED_PINGS_EVERY, RemoteOperator
from mosaic_core.words.control import CONTROL_EXTENSIONS, ControlMessage, Hello, MediaUnavailable

MESSAGE = MediaUnavailable(label="front", code="media.no_line")


class Channel:
    """The control or the stop channel."""

    def __init__(self) -> None:
        self.is_open = True
        self.sent: list[ControlMessage] = []
        self.refused: list[tuple[Any, ...]] = []

    def send(self, message: ControlMessage) -> None:
        self.sent.append(message)

    def refuse(self, *refusal: Any) -> None:
        self.refused.append(refusal)


def operator(**more: bool) -> RemoteOperator:
    return RemoteOperator(Sender("p1", "s1", "o1", "Ann"), **more)


def hello(*, is_person: bool = True, extensions: dict[str, int] = CONTROL_EXTENSIONS) -> Hello:
    return Hello(software="test", boot_id="b", extensions=extensions, is_person=is_person)


def listening(it: RemoteOperator) -> Channel:
    channel: Any = Channel()
    it.control_channel = channel
    return channel  # type: ignore[no-any-return]


def test_before_it_listens_what_is_said_goes_nowhere() -> None:
    it = operator()
    it.answer(MESSAGE)
    it.refuse("arm", 3, "safety.too_fast")
    it.ping()
    channel = listening(it)
    it.answer(MESSAGE)
    it.refuse("arm", 4, "safety.too_fast", "why")
    assert channel.sent == [MESSAGE]
    assert channel.refused == [("arm", 4, "safety.too_fast", "why", "")]


def test_only_who_knows_leases_is_told_of_them_and_who_asks_is_answered() -> None:
    old, new = operator(), operator()
    channels = [listening(one) for one in (old, new)]
    old.said_hello(hello(extensions={}))
    new.said_hello(hello())
    for one in (old, new):
        one.tell(MESSAGE)
    assert [channel.sent for channel in channels] == [[], [MESSAGE]]
    assert (old.sender.is_original, new.sender.is_original) == (True, False)
    old.answer(MESSAGE)
    assert channels[0].sent == [MESSAGE]


@pytest.mark.parametrize("is_program", [False, True])
def test_a_program_is_no_person_whatever_it_says(is_program: bool) -> None:
    it = operator(is_program=is_program)
    assert not it.sender.is_person
    it.said_hello(hello(is_person=True))
    assert it.sender.is_person is not is_program


def test_only_who_came_from_elsewhere_wants_to_know_the_near_path() -> None:
    far, near, old = operator(), operator(is_near=True), operator()
    for one in (far, near):
        one.said_hello(hello())
    old.said_hello(hello(extensions={}))
    assert [one.wants_near for one in (far, near, old)] == [True, False, False]


def test_who_has_no_name_is_called_by_its_id() -> None:
    assert operator().name == "Ann"
    assert RemoteOperator(Sender("p1", "s1")).name == "p1"


def test_pings_take_the_stop_channel_and_seldom_the_ordered_one() -> None:
    it, stop = operator(), Channel()
    ordered, faked = listening(it), stop
    it.link = MeasuredLink()
    for _ in range(2 * ORDERED_PINGS_EVERY):
        it.ping()
    assert len(ordered.sent) == 2
    it.stop_channel = faked  # type: ignore[assignment]
    it.ping()
    stop.is_open = False
    for _ in range(ORDERED_PINGS_EVERY):
        it.ping()
    assert (len(stop.sent), len(ordered.sent)) == (1, 3)
