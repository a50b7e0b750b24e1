"""Nothing of a session's reliable channels flows before both sides have said how far they are, and what was not
confirmed waits for the session's next peer."""

from __future__ import annotations

import asyncio
from types import SimpleNamespace
from typing import Any

import pytest

from mosaic_core.contract.handler import DataChannelReceivable, DataChannelSendable
from mosaic_core.contract.host import Outgoing, Sender
from mosaic_core.machines.delivery.delivery_terms import terms_of
from mosaic_core.machines.delivery.framing import FrameFlag, PayloadKind
from mosaic_core.machines.delivery.send_scheduler import Offered
from mosaic_core.runtime.configuration.receiver_safety import ReceiverSafety
from mosaic_core.runtime.delivery import resumed_stream
from mosaic_core.runtime.delivery.outbox import Outbox
from mosaic_core.runtime.delivery.sessions import SessionBook
from mosaic_core.runtime.handlers.routes import Route
from mosaic_core.runtime.observation.counters import ConnectorCounters
from mosaic_core.runtime.peers import peer_resume
from mosaic_core.runtime.peers.peer_resume import PeerResume
from mosaic_core.words.control import CONTROL_EXTENSIONS, ControlMessage, Delivered, Hello, Resume
from mosaic_core.words.data_type import Delivery

HELLO = Hello(software="test", boot_id="page", extensions=CONTROL_EXTENSIONS)
LEASED, LIMITED = ReceiverSafety(resource="motion"), ReceiverSafety(max_rate_hz=5.0)


class Events(DataChannelSendable[dict[str, Any]]):
    """Sends to operators."""


class Orders(DataChannelReceivable[dict[str, Any]]):
    """Takes from operators."""


def route(label: str, kind: type[Any], delivery: Delivery = Delivery.RELIABLE, safety: Any = None) -> Route:
    connector: Any = SimpleNamespace(terms_of=lambda handler: terms_of(delivery))
    return Route(label, connector, kind(label), ConnectorCounters(), safety or ReceiverSafety())


ROUTES = [
    route("events", Events),
    route("pose", Events, Delivery.LATEST),
    route("map", Events, Delivery.BULK),
    route("orders", Orders),
    route("drive", Orders, Delivery.LATEST),
    route("arm", Orders, safety=LEASED),
    route("horn", Orders, safety=LIMITED),
]


class Robot:
    """What its peers share, with as many peers as the test connects."""

    def __init__(self) -> None:
        self.routes = {
            one.label: Route(one.label, one.connector, one.handler, ConnectorCounters(), one.safety) for one in ROUTES
        }
        outbox = Outbox(asyncio.get_running_loop(), lambda label, on: None)
        for one in self.routes.values():
            outbox.add_channel(one.label, one.terms, one.counters)
        book = SessionBook(outbox, lambda label: self.routes[label].counters)
        self.site: Any = SimpleNamespace(routes=self.routes, outbox=outbox, sessions=book, boot_id="robot")

    def send(self, text: str) -> Offered:
        """What the outbox would say to the session's stream of ``events``."""
        [session] = self.site.sessions._sessions.values()
        offered: Offered = session.streams["events"].deliver(Outgoing("events", PayloadKind.STRING, text.encode(), 0))
        return offered


class Peer:
    """One peer of one operator. ``said``: what the robot told it; ``got``: what its channel ``events`` carried."""

    def __init__(self, robot: Robot, peer_id: str = "p1") -> None:
        self.sender = Sender(peer_id, "session", "ann")
        self.peer_id = peer_id
        self.said: list[ControlMessage] = []
        self.got: list[tuple[str, FrameFlag, int | None]] = []
        self.robot = robot
        self.is_full = False
        operator: Any = self
        self.resume = PeerResume(operator, robot.site)

    def answer(self, message: ControlMessage) -> None:
        self.said.append(message)

    # -- the channel ``events``

    def open_events(self) -> None:
        queue: Any = SimpleNamespace(offer=self._offer, waiting=lambda label: (0, 0))
        link: Any = SimpleNamespace(outgoing=lambda message, flags, seq: (message.payload.decode(), flags, seq))
        if self.resume.opens("events"):
            self.resume.attach("events", queue, link)

    def _offer(self, item: tuple[str, FrameFlag, int | None]) -> Offered:
        if self.is_full:
            return Offered.REFUSED
        self.got.append(item)
        return Offered.QUEUED

    @property
    def texts(self) -> list[str]:
        return [text for text, _, _ in self.got]

    def resumes(self, **more: Any) -> Resume:
        """Say hello and how far one is; what the robot answers."""
        self.resume.said_hello(HELLO)
        self.resume.resume_heard(Resume(**more))
        answer = self.said.pop()
        assert isinstance(answer, Resume)
        return answer


async def turns() -> None:
    for _ in range(5):
        await asyncio.sleep(0)


# -- before data flows


def held(peer: Peer, label: str, *, is_framed: bool = True) -> list[str]:
    """Where ``proceed`` leaves its word."""
    words: list[str] = []
    peer.resume.when_known(peer.robot.routes[label], is_framed, lambda: words.append(label))
    return words


async def test_only_numbered_channels_to_an_operator_of_ours_wait_for_what_it_remembers() -> None:
    peer = Peer(Robot())
    waiting = {label: held(peer, label) for label in peer.robot.routes}
    assert [label for label, words in waiting.items() if not words] == ["events"]
    assert held(peer, "events", is_framed=False) == ["events"], "an original's channel never waits"
    peer.resume.said_hello(HELLO)
    assert waiting["events"] == []
    peer.resume.resume_heard(Resume())
    assert waiting["events"] == ["events"]
    assert held(peer, "events") == ["events"], "and later ones not at all"


async def test_what_waits_for_an_operator_that_resumes_nothing_goes_on_at_its_hello() -> None:
    peer = Peer(Robot())
    words = held(peer, "events")
    extensions = {name: version for name, version in CONTROL_EXTENSIONS.items() if name != "resume"}
    peer.resume.said_hello(Hello(software="test", boot_id="page", extensions=extensions))
    assert words == ["events"]
    assert not peer.resume.keeps("events")


async def test_an_operator_that_does_not_say_how_far_it_is_begins_anew_and_is_told_so_later(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(peer_resume, "HELLO_TIMEOUT_S", 0.0)
    peer = Peer(Robot())
    words = held(peer, "events")
    peer.resume.said_hello(HELLO)
    await turns()
    assert words == ["events"]
    peer.resume.resume_heard(Resume())
    assert peer.said == [Resume(boot_id="robot", is_new=True)]
    assert len(peer.robot.site.sessions) == 0


async def test_a_second_hello_changes_nothing() -> None:
    peer = Peer(Robot())
    peer.resumes()
    peer.resume.said_hello(HELLO)
    peer.resume.resume_heard(Resume())
    assert peer.said == [], "it has resumed already"


async def test_a_resume_before_the_hello_is_not_heard() -> None:
    peer = Peer(Robot())
    peer.resume.resume_heard(Resume())
    assert peer.said == []
    assert len(peer.robot.site.sessions) == 0


# -- resuming


async def test_the_robot_names_what_it_numbers_and_what_it_takes_and_nothing_that_moves() -> None:
    answer = Peer(Robot()).resumes()
    assert answer == Resume(boot_id="robot", is_new=True, received={"orders": 0}, upcoming={"events": 1})


async def test_what_the_lost_peer_has_not_confirmed_comes_on_the_next_one_once() -> None:
    robot = Robot()
    first = Peer(robot)
    first.resumes()
    first.open_events()
    for text in ("a", "b", "c"):
        assert robot.send(text) is Offered.QUEUED
    first.resume.resume_heard(Delivered(seqs={"events": 1, "unknown": 9}))
    first.resume.peer_left("peer.lost")
    second = Peer(robot, "p2")
    answer = second.resumes(boot_id="robot", received={"events": 2})
    assert (answer.is_new, answer.upcoming) == (False, {"events": 3})
    second.open_events()
    assert second.texts == ["c"]
    assert [seq for _, _, seq in second.got] == [3]


async def test_another_run_of_the_operators_page_begins_anew() -> None:
    robot = Robot()
    Peer(robot).resumes()
    second = Peer(robot, "p2")
    second.resume.said_hello(HELLO.model_copy(update={"boot_id": "another page"}))
    second.resume.resume_heard(Resume(boot_id="robot"))
    assert second.said == [Resume(boot_id="robot", is_new=True, received={"orders": 0}, upcoming={"events": 1})]


async def test_what_an_operator_remembers_of_another_boot_of_the_robot_means_nothing() -> None:
    robot = Robot()
    first = Peer(robot)
    first.resumes()
    first.open_events()
    robot.send("a")
    first.resume.peer_left("peer.lost")
    second = Peer(robot, "p2")
    second.resumes(boot_id="another", received={"events": 0})
    second.open_events()
    assert second.texts == [], "it wants nothing of before"


async def test_who_leaves_on_purpose_leaves_nothing_who_is_lost_may_come_back() -> None:
    for code, is_new in (("peer.closed", True), ("peer.lost", False)):
        robot = Robot()
        first = Peer(robot)
        first.resumes()
        first.resume.peer_left(code)
        assert not first.resume.keeps("events")
        assert Peer(robot, "p2").resumes().is_new is is_new


async def test_the_peer_that_was_replaced_ends_nothing_of_the_session_any_more() -> None:
    robot = Robot()
    first, second = Peer(robot), Peer(robot, "p2")
    first.resumes()
    second.resumes()
    assert not first.resume.keeps("events")
    first.resume.peer_left("peer.closed")
    assert second.resume.keeps("events")
    assert len(robot.site.sessions) == 1


# -- channels


async def test_a_newcomer_begins_with_the_latched_value_who_comes_back_does_not() -> None:
    robot = Robot()
    robot.site.outbox.post(Outgoing("events", PayloadKind.STRING, b"state", 0))
    await turns()
    first = Peer(robot)
    first.resumes()
    first.open_events()
    assert first.got == [("state", FrameFlag.LATCHED, 1)]
    first.resume.peer_left("peer.lost")
    second = Peer(robot, "p2")
    second.resumes(boot_id="robot", received={"events": 1})
    second.open_events()
    assert second.got == []


async def test_a_channel_that_closed_alone_was_released_unless_its_peer_is_lost_meanwhile(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(peer_resume, "RELEASE_AFTER_S", 0.0)
    for is_lost, texts in ((False, []), (True, ["a"])):
        robot = Robot()
        first = Peer(robot)
        first.resumes()
        first.open_events()
        robot.send("a")
        first.resume.channel_closed("events")
        if is_lost:
            first.resume.peer_left("peer.lost")
        await turns()
        first.resume.peer_left("peer.lost")
        second = Peer(robot, "p2")
        second.resumes(boot_id="robot", received={"events": 0})
        second.open_events()
        assert second.texts == texts


async def test_a_channel_that_opens_again_on_its_peer_has_a_new_listener() -> None:
    robot = Robot()
    peer = Peer(robot)
    peer.resumes()
    peer.open_events()
    robot.send("a")
    peer.resume.channel_closed("events")
    robot.send("b")
    peer.open_events()
    robot.send("c")
    assert peer.texts == ["a", "c"], "what was said to nobody is not said to the next"


async def test_channels_outside_of_the_session_are_not_its_business() -> None:
    peer = Peer(Robot())
    peer.resume.channel_closed("events")
    peer.resumes()
    peer.resume.channel_closed("pose")
    assert not peer.resume.opens("pose")
    peer.resume.has_room("pose")


async def test_a_full_queue_goes_on_when_it_has_room() -> None:
    robot = Robot()
    peer = Peer(robot)
    peer.resumes()
    peer.open_events()
    robot.send("a")
    first = peer.got[:]
    peer.is_full = True
    assert robot.send("b") is Offered.REFUSED
    peer.resume.peer_left("peer.lost")
    second = Peer(robot, "p2")
    second.resumes(boot_id="robot", received={"events": 0})
    second.is_full = True
    second.open_events()
    assert second.got == []
    second.is_full = False
    second.resume.has_room("events")
    assert second.got == first


# -- what arrives


async def test_what_arrives_twice_is_taken_once_and_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(resumed_stream, "TELL_PERIOD_S", 0.0)
    peer = Peer(Robot())
    orders = peer.robot.routes["orders"]
    assert peer.resume.arrived(orders, 7), "before it resumes everything is new"
    peer.resumes()
    assert [peer.resume.arrived(orders, seq) for seq in (1, 2, 2, 1, 3)] == [True, True, False, False, True]
    assert peer.said == []
    await turns()
    assert peer.said == [Delivered(seqs={"orders": 3})], "together, a little later"
    await turns()
    assert len(peer.said) == 1


async def test_after_many_messages_it_is_told_at_once_and_not_again() -> None:
    peer = Peer(Robot())
    orders = peer.robot.routes["orders"]
    peer.resumes()
    for seq in range(1, 2 * resumed_stream.TELL_AFTER + 2):
        peer.resume.arrived(orders, seq)
    told = [resumed_stream.TELL_AFTER, 2 * resumed_stream.TELL_AFTER]
    assert peer.said == [Delivered(seqs={"orders": seq}) for seq in told]


async def test_what_never_comes_is_counted() -> None:
    robot = Robot()
    first = Peer(robot)
    first.resumes(upcoming={"orders": 1})
    orders = robot.routes["orders"]
    first.resume.arrived(orders, 1)
    first.resume.arrived(orders, 4)
    assert orders.counters.lost == 2
    first.resume.peer_left("peer.lost")
    answer = Peer(robot, "p2").resumes(boot_id="robot", upcoming={"orders": 8})
    assert answer.received["orders"] == 4, "what is lost has not arrived"
    assert orders.counters.lost == 5


async def test_who_has_left_is_told_nothing_any_more(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(resumed_stream, "TELL_PERIOD_S", 0.0)
    peer = Peer(Robot())
    peer.resumes()
    peer.resume.arrived(peer.robot.routes["orders"], 1)
    peer.resume.peer_left("peer.lost")
    await turns()
    assert peer.said == []
