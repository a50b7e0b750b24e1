"""Operators in Python at a real robot, in memory: take, hand over, force, expire, stop, clear, and wrong clocks."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Any, ClassVar

import pytest

from mosaic_core import DataChannelConfigurer, DataChannelReceivable, Request, RequestHandler
from mosaic_core.contract.params import Message, NoParams
from mosaic_core.laboratory.memory_server import BASE_URL
from mosaic_core.operator import (
    LeaseDenied,
    LeaseLost,
    MosaicOperator,
    RequestRefused,
    RobotConnection,
    SendableStore,
)
from mosaic_core.testing import Joined, connector, joined, until
from mosaic_core.words.signaling import RobotStatus

HOUR_US = 3_600_000_000
WAIT_S = 30.0


class Wish(Message):
    speed_mps: float


class Sled(DataChannelReceivable[Wish]):
    timeout_s = 0.3
    requires_lease = True
    motion_fields: ClassVar[tuple[str, ...]] = ("speed_mps",)

    def __init__(self, label: str) -> None:
        super().__init__(label)
        self.acts: list[Any] = []

    def handle_data(self, data: Wish) -> None:
        self.acts.append(data.speed_mps)

    def make_safe(self, cause: str) -> None:
        self.acts.append(cause)


class SledConfigurer(DataChannelConfigurer[NoParams]):
    def configure(self) -> Sled:
        return Sled(self.label)


class Place:
    """A robot with a sled; nobody holds the lease yet."""

    def __init__(self, link: Joined) -> None:
        self.link = link
        self.alice = link.connection

    @property
    def acts(self) -> list[Any]:
        handler = self.link.configured.connectors[0].handlers[0]
        assert isinstance(handler, Sled)
        return handler.acts

    async def pad(self, connection: RobotConnection) -> SendableStore:
        pad = connection.sendable("sled")
        await pad.wait_open(WAIT_S)
        return pad


@asynccontextmanager
async def at_a_robot(timeout_s: float = Sled.timeout_s, **control: Any) -> AsyncIterator[Any]:
    entry = connector(SledConfigurer, label="sled", safety={"timeout_s": timeout_s})
    async with asyncio.timeout(60), joined(entry, takes_leases=False, control=control) as link:
        await link.connection.control.wait_for(lambda: link.connection.control.leases, WAIT_S)
        yield Place(link)


async def drive_until(place: Place, pad: SendableStore, condition: Callable[[], object]) -> None:
    """Command twenty times a second until it is so."""
    async with asyncio.timeout(WAIT_S):
        while not condition():
            pad.send_json({"speed_mps": 0.5})
            await asyncio.sleep(0.05)


async def test_only_the_holder_moves_the_robot_and_others_are_told_why() -> None:
    async with at_a_robot() as place:
        bob = await place.link.another_operator("Bob")
        told: list[str] = []
        bob.on_refusal(lambda refusal: told.append(refusal.code))
        hers, his = await place.pad(place.alice), await place.pad(bob)
        await drive_until(place, his, lambda: told)
        assert told == ["lease.required"]
        async with await place.alice.control.take():
            await drive_until(place, hers, lambda: place.acts)
            await drive_until(place, his, lambda: "lease.not_holder" in told)
        await until(lambda: place.acts[-1] == "safety.lease_lost")


async def test_a_person_who_asks_waits_for_the_holders_answer_and_gets_the_lease() -> None:
    async with at_a_robot() as place:
        bob = await place.link.another_operator("Bob")
        lease = await place.alice.control.take()
        asking = asyncio.create_task(bob.control.take(reason="my turn", wait_s=WAIT_S))
        await place.alice.control.wait_for(lambda: place.alice.control.leases["motion"].queue, WAIT_S)
        (waiting,) = place.alice.control.leases["motion"].queue
        assert (waiting.name, waiting.reason) == ("Bob", "my turn")
        place.alice.control.answer(waiting.peer_id, grant=True)
        his = await asking
        assert (await lease.wait_lost()) is not None
        assert lease.lost is not None
        assert lease.lost.code == "lease.handed_over"
        assert his.is_held
        assert bob.control.leases["motion"].is_mine
        assert not place.alice.control.leases["motion"].is_mine


async def test_a_holder_may_say_no() -> None:
    async with at_a_robot() as place:
        bob = await place.link.another_operator("Bob")
        lease = await place.alice.control.take()
        asking = asyncio.create_task(bob.control.take(wait_s=WAIT_S))
        await place.alice.control.wait_for(lambda: place.alice.control.leases["motion"].queue, WAIT_S)
        place.alice.control.answer(bob.peer_id, grant=False, message="in a minute")
        with pytest.raises(LeaseDenied, match="in a minute") as denied:
            await asking
        assert denied.value.code == "lease.denied"
        assert lease.is_held


async def test_a_supervisor_takes_over_with_a_reason_and_nobody_else_does() -> None:
    async with at_a_robot() as place:
        bob = await place.link.another_operator("Bob")
        dana = await place.link.another_operator("Dana", role="supervisor")
        lease = await place.alice.control.take()
        for who, reason in ((bob, "I want to"), (dana, " ")):
            with pytest.raises(LeaseDenied) as denied:
                await who.control.take(force=True, reason=reason)
            assert denied.value.code == "lease.force_forbidden"
        assert lease.is_held
        async with await dana.control.take(force=True, reason="she is asleep"):
            lost = await lease.wait_lost()
            assert lost is not None
            assert (lost.code, lost.message) == ("lease.taken_over", "she is asleep")
        entries = await dana.control.journal(20)
        assert "she is asleep" in {entry.message for entry in entries}
        with pytest.raises(LeaseDenied) as forbidden:
            await bob.control.journal()
        assert forbidden.value.code == "auth.forbidden"


async def test_a_program_gives_way_to_a_person_in_the_middle_of_its_drive() -> None:
    async with at_a_robot() as place:
        program = await place.link.another_operator("patrol", is_person=False)
        pad = await place.pad(program)

        async def patrol() -> None:
            async with await program.control.take():
                await drive_until(place, pad, lambda: False)

        patrolling = asyncio.create_task(patrol())
        await until(lambda: 0.5 in place.acts)
        async with await place.alice.control.take():
            with pytest.raises(LeaseLost) as lost:
                await patrolling
            assert lost.value.code == "lease.preempted"
            await until(lambda: place.acts[-1] == "safety.lease_lost")
            with pytest.raises(LeaseDenied) as denied:
                await program.control.take()
            assert denied.value.code == "lease.person_commands"


async def test_a_lease_outlives_silence_by_its_keep_alive_and_dies_with_it() -> None:
    async with at_a_robot(lease_expiry_s=1.0) as place:
        bob = await place.link.another_operator("Bob")
        lease = await place.alice.control.take()
        await asyncio.sleep(1.5)
        assert lease.is_held
        assert bob.control.leases["motion"].holder is not None
        first, *_ = place.link.network.links.values()
        first.is_cut = True
        since_s = time.monotonic()
        await bob.control.wait_for(lambda: bob.control.leases["motion"].holder is None, WAIT_S)
        assert time.monotonic() - since_s < 5.0
        assert (await bob.control.take()).is_held


async def test_anybody_stops_the_robot_and_only_a_holder_or_supervisor_clears_it() -> None:
    async with at_a_robot() as place:
        watcher = await place.link.another_operator("Wanda", role="observer")
        pad = await place.pad(place.alice)
        told: list[str] = []
        place.alice.on_refusal(lambda refusal: told.append(refusal.code))
        async with await place.alice.control.take():
            await drive_until(place, pad, lambda: 0.5 in place.acts)
            report = await watcher.control.stop("a dog")
            assert report.is_safe
            assert report.acknowledged_s < 5.0
            assert report.safe_s is not None
            assert report.received_s is not None
            assert report.received_s <= report.safe_s <= report.acknowledged_s + 0.01
            assert place.acts[-1] == "safety.stop"
            await drive_until(place, pad, lambda: "safety.stopped" in told)
            assert place.acts[-1] == "safety.stop"
            state = place.alice.control.stop_state
            assert state is not None
            assert (state.is_stopped, state.by, state.reason) == (True, "Wanda", "a dog")
            with pytest.raises(LeaseDenied) as denied:
                await watcher.control.clear_stop()
            assert denied.value.code == "lease.forbidden"
            await place.alice.control.clear_stop()
            await drive_until(place, pad, lambda: "safety.release_first" in told)
            assert 0.5 not in place.acts[place.acts.index("safety.stop") :], "it does not move by itself"
            pad.send_json({"speed_mps": 0.0})
            await drive_until(place, pad, lambda: place.acts[-1] == 0.5)


def rights_told(operator: RobotConnection) -> list[tuple[str, bool | None, str]]:
    """Whose right to stop was changed, to what, and by whom, as this operator hears it."""
    changed = [peer for peer in operator.control.peers if peer.stop_right_by is not None]
    return [(peer.name, peer.may_stop, peer.stop_right_by or "") for peer in changed]


async def test_a_supervisor_takes_the_right_to_stop_from_an_observer_who_says_it_for_ever() -> None:
    async with at_a_robot() as place:
        watcher = await place.link.another_operator("Wanda", role="observer")
        boss = await place.link.another_operator("Boss", role="supervisor")
        assert watcher.peer_id is not None
        with pytest.raises(LeaseDenied) as denied:
            await place.alice.control.change_stop_right(watcher.peer_id, may_stop=False)
        assert denied.value.code == "auth.forbidden"
        await boss.control.change_stop_right(watcher.peer_id, may_stop=False)
        for everybody in (place.alice, boss, watcher):
            await everybody.control.wait_for(lambda one=everybody: rights_told(one) == [("Wanda", False, "Boss")])
        with pytest.raises(LeaseDenied) as denied:
            await watcher.control.stop("again")
        assert denied.value.code == "safety.stop_taken"
        assert boss.control.stop_state is not None
        assert not boss.control.stop_state.is_stopped
        entries = [(entry.what, entry.who, entry.subject, entry.message) for entry in await boss.control.journal()]
        assert ("stop.right_taken", "Boss", "Wanda", "of the account Wanda") in entries
        await boss.control.change_stop_right(watcher.peer_id, may_stop=True)
        await watcher.control.wait_for(lambda: rights_told(watcher) == [("Wanda", None, "Boss")])
        assert (await watcher.control.stop("now")).is_safe
        assert place.alice.peer_id is not None
        with pytest.raises(LeaseDenied) as denied:
            await boss.control.change_stop_right(place.alice.peer_id, may_stop=False)
        assert denied.value.code == "safety.always_stops"


async def test_an_observer_is_refused_the_lease_and_the_robot() -> None:
    async with at_a_robot() as place:
        watcher = await place.link.another_operator("Wanda", role="observer")
        told: list[str] = []
        watcher.on_refusal(lambda refusal: told.append(refusal.code))
        with pytest.raises(LeaseDenied) as denied:
            await watcher.control.take()
        assert denied.value.code == "lease.forbidden"
        await drive_until(place, await place.pad(watcher), lambda: told)
        assert told == ["lease.forbidden"]
        assert place.acts == []


async def test_everybody_sees_who_is_there() -> None:
    async with at_a_robot() as place:
        await place.link.another_operator("patrol", is_person=False)
        await place.link.another_operator("Wanda", role="observer")
        await place.alice.control.wait_for(lambda: len(place.alice.control.peers) == 3, WAIT_S)
        seen = {peer.name: (peer.role, peer.is_person) for peer in place.alice.control.peers}
        assert seen == {"Alice": ("operator", True), "patrol": ("operator", False), "Wanda": ("observer", True)}


@pytest.mark.parametrize("skew_us", [HOUR_US, -time.monotonic_ns() // 1000], ids=["an hour ahead", "just begun"])
async def test_another_time_on_the_operators_clock_changes_nothing(skew_us: int) -> None:
    async with at_a_robot(timeout_s=2.0) as place:  # a busy machine may keep a command for a second
        link = place.link
        async with MosaicOperator(
            BASE_URL, "Tom", open_socket=link._server.connect, make_offerer=link.network.offerer,
            http=link._server.http(), is_person=True, clock_us=lambda: time.monotonic_ns() // 1000 + skew_us,
        ) as operator:  # fmt: skip
            robot_id = link.robot.robot_id
            await operator.wait_status(robot_id, RobotStatus.READY_TO_CONNECT, WAIT_S)
            tom = await operator.connect(robot_id, timeout_s=WAIT_S)
            told: list[str] = []
            tom.on_refusal(lambda refusal: told.append(refusal.code))
            pad = await place.pad(tom)
            async with await tom.control.take() as lease:
                began_s = time.monotonic()
                await drive_until(place, pad, lambda: time.monotonic() - began_s > 2.5)
                assert lease.is_held
                assert told == []
                assert set(place.acts) == {0.5}
                assert tom.clock_offset_us is not None
                assert abs(tom.clock_offset_us + skew_us) < 1_000_000
                report = await tom.control.stop()
                assert report.safe_s is not None
                assert report.safe_s <= report.acknowledged_s + 0.01 < WAIT_S
                await tom.control.clear_stop()
                pad.send_json({"speed_mps": 0.0})  # lets go
                await drive_until(place, pad, lambda: place.acts[-1] == 0.5)
                await until(lambda: place.acts[-1] == "safety.timeout")


async def test_a_connection_that_is_cut_comes_back_with_its_lease_before_anybody_else_gets_it() -> None:
    async with at_a_robot(lease_expiry_s=20.0) as place:
        link = place.link
        async with MosaicOperator(
            BASE_URL, "Tom", open_socket=link._server.connect, make_offerer=link.network.offerer,
            http=link._server.http(), is_person=True,
        ) as operator:  # fmt: skip
            tom = await operator.connect(link.robot.robot_id, timeout_s=WAIT_S, reconnect=True)
            pad = await place.pad(tom)
            lease = await tom.control.take()
            first_epoch = lease.epoch
            await drive_until(place, pad, lambda: place.acts)
            list(link.network.links.values())[-1].is_cut = True
            await until(lambda: place.acts[-1] == "safety.timeout")
            await until(lambda: tom.state == "connected" and lease.is_held and lease.epoch != first_epoch)
            await pad.wait_open(WAIT_S)
            await drive_until(place, pad, lambda: place.acts[-1] == 0.5)


class Note(DataChannelReceivable[str]):
    """Moves nothing."""

    def handle_data(self, data: str) -> None: ...


class NoteConfigurer(DataChannelConfigurer[NoParams]):
    def configure(self) -> Note:
        return Note(self.label)


async def test_the_journal_tells_of_what_moves_and_of_who_lost_the_lease() -> None:
    entries = [connector(SledConfigurer, label="sled"), connector(NoteConfigurer, label="note")]
    async with joined(*entries, takes_leases=False) as link:
        dana = await link.another_operator("Dana", role="supervisor")
        note, sled = dana.sendable("note"), dana.sendable("sled")
        await asyncio.gather(note.wait_open(WAIT_S), sled.wait_open(WAIT_S))
        async with await dana.control.take():
            assert note.send_data("moves nothing")
            assert sled.send_json({"speed_mps": 0.5})
            handler = link.configured.connectors[0].handlers[0]
            assert isinstance(handler, Sled)
            await until(lambda: handler.acts)
        await until(lambda: dana.control.leases["motion"].holder is None)
        journal = [(entry.what, entry.subject, entry.who) for entry in await dana.control.journal(20)]
    assert ("command.accepted", "sled", "Dana") in journal
    assert ("lease.ended", "motion", "Dana") in journal
    assert not [entry for entry in journal if entry[1] == "note"]


@asynccontextmanager
async def at_arms(*resources: str) -> AsyncIterator[Joined]:
    """A robot with a sled for each lease, which is called like it."""
    sleds = [connector(SledConfigurer, label=name, safety={"timeout_s": 1.0, "resource": name}) for name in resources]
    async with asyncio.timeout(60), joined(*sleds, takes_leases=False) as link:
        await link.connection.control.wait_for(lambda: link.connection.control.leases, WAIT_S)
        yield link


async def test_who_names_no_lease_takes_the_only_one_that_is_needed() -> None:
    async with at_arms("arm") as link:
        control = link.connection.control
        async with await control.take() as lease:
            assert lease.resource == "arm"
            assert not control.leases["motion"].is_mine
            control.release()
            assert not lease.is_held


async def test_who_names_no_lease_where_several_are_needed_is_told_which() -> None:
    async with at_arms("left_arm", "right_arm") as link:
        with pytest.raises(LeaseDenied) as denied:
            await link.connection.control.take()
        assert denied.value.code == "lease.unknown_resource"
        assert denied.value.message == (
            "No connector of this robot needs the lease 'motion'. Needed are: left_arm, right_arm."
        )
        assert denied.value.cure == "Name one: `await connection.control.take('left_arm')`."
        async with await link.connection.control.take("motion") as lease:
            assert lease.is_held  # who names it means it


async def test_motion_is_the_usual_one_where_a_connector_needs_it() -> None:
    async with at_arms("arm", "motion") as link, await link.connection.control.take() as lease:
        assert lease.resource == "motion"


async def test_a_lease_that_there_is_not_is_denied_with_those_that_there_are() -> None:
    async with at_arms("arm") as link:
        with pytest.raises(LeaseDenied, match=r"The lease 'amr': The robot has no resource of this name\.") as denied:
            await link.connection.control.take("amr")
        assert denied.value.cure == "did you mean 'arm'? There are: arm, motion."


async def test_a_refused_command_names_its_lease_its_holder_and_the_call() -> None:
    async with at_arms("arm") as link:
        told: list[str | None] = []
        link.connection.on_refusal(lambda refusal: told.append(refusal.message))
        pad = link.connection.sendable("arm")
        await pad.wait_open(WAIT_S)
        pad.send_json({"speed_mps": 0.5})
        await until(lambda: told)
        call = "Take it: `await connection.control.take('arm')`."
        assert told == [f"'arm' takes commands with the lease 'arm'. {call}"]
        bob = await link.another_operator("Bob")
        async with await bob.control.take("arm"):
            await link.connection.control.wait_for(lambda: link.connection.control.leases["arm"].holder, WAIT_S)
            pad.send_json({"speed_mps": 0.5})
            await until(lambda: len(told) > 1)
            with pytest.raises(LeaseDenied, match=r"The lease 'arm': .* Bob holds it\."):
                await link.connection.control.take("arm")
        assert told[1] == f"'arm' takes commands with the lease 'arm'. Bob holds it. {call}"


class Weighing(RequestHandler[Wish, Wish]):
    requires_lease = True
    resource = "scales"

    def answer(self, question: Wish, request: Request) -> Wish:
        return question


class WeighingConfigurer(DataChannelConfigurer[NoParams]):
    def configure(self) -> Weighing:
        return Weighing(self.label)


async def test_a_refused_request_names_its_lease() -> None:
    async with asyncio.timeout(60), joined(connector(WeighingConfigurer, label="weigh"), takes_leases=False) as link:
        with pytest.raises(
            RequestRefused, match=r"'weigh' takes commands with the lease 'scales'\. Take it"
        ) as refused:
            await link.connection.request("weigh", {"speed_mps": 1.0})
        assert refused.value.code == "lease.required"
