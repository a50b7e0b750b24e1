"""Taking, keeping and losing leases, and stopping, against a robot in memory."""

from __future__ import annotations

import asyncio
import json
import time
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import asynccontextmanager
from typing import Any

import pytest

from mosaic_core.operator import Lease, LeaseDenied, LeaseLost, RobotConnection, StopReport
from mosaic_core.testing import until
from mosaic_core.words import control
from mosaic_core.words.errors import ConnectionFailed

WAIT_S = 30.0
Scenario = Callable[[Any, RobotConnection], Any]


@asynccontextmanager
async def with_connection(world: Any, **more: Any) -> AsyncIterator[Any]:
    async with asyncio.timeout(30), world.operator(**more) as operator:
        yield world.robot, await operator.connect(world.robot_id, timeout_s=WAIT_S)


def reply(outcome: Any, code: str = "", epoch: int = 0, resource: str = "motion") -> control.LeaseReply:
    return control.LeaseReply(resource=resource, outcome=outcome, epoch=epoch, code=code)


def state(holder: str | None, epoch: int, *waiting: str) -> control.LeaseState:
    return control.LeaseState(
        resource="motion",
        epoch=epoch,
        holder=control.PeerInfo(peer_id=holder) if holder else None,
        queue=tuple(control.LeaseWaiting(peer_id=peer) for peer in waiting),
        expiry_s=2,
    )


def answering(*answers: control.ControlMessage) -> Callable[[Any], Sequence[control.ControlMessage]]:
    return lambda message: answers if isinstance(message, control.LeaseRequest) else ()


async def test_a_command_carries_the_epoch_that_is_held_when_it_is_made(world: Any) -> None:
    async with with_connection(world) as (robot, connection):
        pad, lamp = connection.sendable("cmd_vel"), connection.sendable("lamp")
        await pad.wait_open(WAIT_S)
        await lamp.wait_open(WAIT_S)
        channel = robot.channels["cmd_vel"]
        pad.send_json({})
        lease = await connection.control.take(reason="a test")
        pad.send_json({})
        lamp.send_json({})
        channel.buffered_bytes = 100_000
        pad.send_json({"late": 1})
        lease.release()
        channel.buffered_bytes = 0
        channel.on_drained()
        pad.send_json({})
        assert [frame.epoch for frame in channel.frames()] == [0, 7, 7, 0]
        assert [frame.seq for frame in channel.frames()] == [1, 2, 3, 4]
        assert [frame.epoch for frame in robot.channels["lamp"].frames()] == [0]
        assert robot.said(control.LeaseRequest) == [control.LeaseRequest(resource="motion", reason="a test")]
        assert robot.said(control.LeaseRelease) == [control.LeaseRelease(resource="motion")]


async def test_a_lease_is_kept_alive_until_it_is_given_back(world: Any) -> None:
    async with with_connection(world) as (robot, connection):
        async with await connection.control.take() as lease:
            assert connection.control.leases["motion"].is_mine
            await until(lambda: len(robot.said(control.LeaseKeep)) >= 2)
            assert {keep.epochs["motion"] for keep in robot.said(control.LeaseKeep)} == {lease.epoch}
        assert not lease.is_held
        assert not connection.control.leases["motion"].is_mine
        kept = len(robot.said(control.LeaseKeep))
        await asyncio.sleep(0.7)
        assert len(robot.said(control.LeaseKeep)) == kept


@pytest.mark.parametrize("code", ["lease.person_commands", "lease.forbidden", "lease.force_forbidden"])
async def test_a_refused_lease_raises_with_the_robots_code(world: Any, code: str) -> None:
    async with with_connection(world) as (robot, connection):
        robot.answer_to = answering(reply("denied", code))
        with pytest.raises(LeaseDenied) as denied:
            await connection.control.take(force=True, reason="because")
        assert denied.value.code == code
        assert robot.said(control.LeaseRequest)[0].force
        assert robot.said(control.LeaseRelease) == []


async def test_who_does_not_wait_leaves_the_queue_again(world: Any) -> None:
    async with with_connection(world) as (robot, connection):
        robot.answer_to = answering(reply("queued", "lease.queued"))
        with pytest.raises(LeaseDenied) as denied:
            await connection.control.take()
        assert denied.value.code == "lease.queued"
        assert len(robot.said(control.LeaseRelease)) == 1


async def test_who_waits_gets_the_lease_when_it_becomes_free(world: Any) -> None:
    async with with_connection(world) as (robot, connection):
        robot.answer_to = answering(reply("queued", "lease.queued"))
        taking = asyncio.create_task(connection.control.take(wait_s=WAIT_S))
        await until(lambda: robot.said(control.LeaseRequest))
        robot.say(reply("granted", epoch=9))
        assert (await taking).epoch == 9


async def test_a_grant_that_crosses_giving_up_is_not_used(world: Any) -> None:
    async with with_connection(world) as (robot, connection):
        robot.answer_to = answering(reply("queued", "lease.queued"))
        with pytest.raises(LeaseDenied):
            await connection.control.take()
        robot.say(reply("granted", epoch=9))
        assert connection.control.epoch_of("motion") == 0


async def test_giving_back_and_taking_again_at_once_is_not_mistaken_for_a_refusal(world: Any) -> None:
    async with with_connection(world) as (robot, connection):
        first = await connection.control.take()
        robot.answer_to = lambda message: []
        first.release()
        taking = asyncio.create_task(connection.control.take())
        await until(lambda: len(robot.said(control.LeaseRequest)) == 2)
        robot.say(reply("ended", "lease.released"))
        robot.say(reply("granted", epoch=99))
        assert (await taking).epoch == 99


async def test_losing_the_lease_cancels_the_block_that_drives_and_says_why(world: Any) -> None:
    async with with_connection(world) as (robot, connection):
        lost: list[LeaseLost] = []

        async def drive() -> None:
            async with await connection.control.take() as lease:
                lease.on_lost(lost.append)
                robot.say(reply("ended", "lease.taken_over"))
                await asyncio.sleep(WAIT_S)

        with pytest.raises(LeaseLost) as raised:
            await drive()
        assert raised.value.code == "lease.taken_over"
        assert [one.code for one in lost] == ["lease.taken_over"]
        assert connection.control.epoch_of("motion") == 0
        assert robot.said(control.LeaseRelease) == []
        await asyncio.sleep(0)  # this task goes on: the cancellation was for the block only


async def test_an_error_of_the_block_is_not_hidden_by_a_lost_lease(world: Any) -> None:
    async with with_connection(world) as (robot, connection):

        async def drive() -> None:
            async with await connection.control.take():
                robot.say(reply("ended", "lease.expired"))
                raise ZeroDivisionError

        with pytest.raises(ZeroDivisionError):
            await drive()
        await asyncio.sleep(0)


async def test_a_block_that_somebody_else_cancels_stays_cancelled(world: Any) -> None:
    async with with_connection(world) as (robot, connection):
        entered = asyncio.Event()

        async def drive() -> None:
            async with await connection.control.take():
                entered.set()
                await asyncio.sleep(WAIT_S)

        driving = asyncio.create_task(drive())
        await entered.wait()
        driving.cancel()
        robot.say(reply("ended", "lease.expired"))
        with pytest.raises(asyncio.CancelledError):
            await driving


async def test_a_lease_outside_a_block_tells_its_loss_when_asked(world: Any) -> None:
    async with with_connection(world) as (robot, connection):
        lease: Lease = await connection.control.take()
        waiting = asyncio.create_task(lease.wait_lost())
        robot.say(state("somebody", 99))
        lost = await waiting
        assert lost is not None
        assert lost.code == "lease.not_holder"
        assert lease.lost is lost
        with pytest.raises(LeaseLost):
            async with lease:
                pass


async def test_the_end_of_the_connection_ends_the_lease_and_who_waits_for_one(world: Any) -> None:
    async with with_connection(world) as (robot, connection):
        lease = await connection.control.take()
        robot.answer_to = answering()
        taking = asyncio.create_task(connection.control.take("arm"))
        await until(lambda: len(robot.said(control.LeaseRequest)) == 2)
        robot.say(control.Bye(code="peer.shutdown"))
        with pytest.raises(LeaseDenied):
            await taking
        assert lease.lost is not None
        with pytest.raises(ConnectionFailed):
            await connection.control.take()


async def test_the_holder_answers_who_asks(world: Any) -> None:
    async with with_connection(world) as (robot, connection):
        lease = await connection.control.take()
        robot.say(state(world.peer_id, lease.epoch, "bob"))
        assert [waiting.peer_id for waiting in connection.control.leases["motion"].queue] == ["bob"]
        connection.control.answer("bob", grant=False, message="in a minute")
        answer = robot.said(control.LeaseAnswer)[0]
        assert (answer.peer_id, answer.grant, answer.message) == ("bob", False, "in a minute")


async def test_a_robot_without_leases_is_told_from_one_with(world: Any) -> None:
    world.robot.extensions = {"catalogue": 1}
    async with with_connection(world) as (_robot, connection):
        assert not connection.control.is_available
        with pytest.raises(LeaseDenied, match="lease") as denied:
            await connection.control.take()
        assert "Update" in denied.value.cure
        with pytest.raises(ConnectionFailed, match="stop"):
            await connection.control.stop()


def stop_acks(safe: bool = True) -> Callable[[Any], Sequence[control.ControlMessage]]:
    def answers(message: control.ControlMessage) -> Sequence[control.ControlMessage]:
        if not isinstance(message, control.Stop):
            return ()
        return [control.StopAck(id=message.id, received_us=5_000_000, safe_us=5_010_000 if safe else None)]

    return answers


async def test_a_stop_is_said_on_both_channels_and_repeated_until_it_is_acknowledged(world: Any) -> None:
    async with with_connection(world) as (robot, connection):
        robot.loses_stops, robot.answer_to = 3, stop_acks()
        report = await connection.control.stop("a dog")
        assert isinstance(report, StopReport)
        assert report.copies == 4
        assert report.acknowledged_s >= 0.065
        assert report.is_safe
        assert {stop.id for stop in robot.stops} == {stop.id for stop in robot.said(control.Stop)}
        assert robot.stops[0].reason == "a dog"
        assert len(robot.said(control.Stop)) == 1
        heard = len(robot.stops)
        await asyncio.sleep(0.1)
        assert len(robot.stops) == heard


async def test_a_stop_that_nobody_waits_for_any_more_is_said_on(world: Any) -> None:
    async with with_connection(world) as (robot, connection):
        robot.answer_to = answering()
        stopping = asyncio.create_task(connection.control.stop())
        await until(lambda: robot.stops)
        stopping.cancel()
        heard = len(robot.stops)
        await until(lambda: len(robot.stops) > heard + 3)


async def test_a_stop_that_is_never_answered_ends_with_the_connection(world: Any) -> None:
    async with with_connection(world) as (robot, connection):
        robot.answer_to = answering()
        stopping = asyncio.create_task(connection.control.stop())
        await until(lambda: robot.stops)
        robot.say(control.Bye(code="peer.shutdown"))
        with pytest.raises(ConnectionFailed):
            await stopping


async def test_clearing_the_stop_waits_for_the_robot_and_tells_its_refusal(world: Any) -> None:
    async with with_connection(world) as (robot, connection):
        robot.say(control.StopState(is_stopped=True, by="Bob"))
        robot.answer_to = lambda message: (
            [control.Refusal(label="_mosaic", code="lease.forbidden")] if isinstance(message, control.StopClear) else []
        )
        with pytest.raises(LeaseDenied) as denied:
            await connection.control.clear_stop()
        assert denied.value.code == "lease.forbidden"
        robot.answer_to = lambda message: (
            [control.StopState(is_stopped=False)] if isinstance(message, control.StopClear) else []
        )
        await connection.control.clear_stop()
        assert connection.control.stop_state == control.StopState(is_stopped=False)
        assert len(robot.said(control.StopClear)) == 2
        await connection.control.clear_stop()
        assert len(robot.said(control.StopClear)) == 2


async def test_a_stop_is_cleared_although_the_robot_s_state_still_travels(world: Any) -> None:
    async with with_connection(world) as (robot, connection):
        robot.say(control.StopState(is_stopped=False))
        await connection.control.wait_for(lambda: connection.control.stop_state is not None, 30.0)
        robot.answer_to = stop_acks()
        await connection.control.stop()
        robot.answer_to = lambda message: (
            [control.StopState(is_stopped=False)] if isinstance(message, control.StopClear) else []
        )
        await connection.control.clear_stop()
        assert len(robot.said(control.StopClear)) == 1
        await connection.control.clear_stop()
        assert len(robot.said(control.StopClear)) == 1


async def test_the_journal_is_read_and_its_refusal_told(world: Any) -> None:
    async with with_connection(world) as (robot, connection):
        one = control.JournalEntry(number=1, at="2026-01-01T00:00:00Z", what="stop", who="Bob")
        robot.answer_to = lambda message: (
            [control.Journal(entries=(one,))] if isinstance(message, control.JournalRead) else []
        )
        assert await connection.control.journal(5) == (one,)
        assert robot.said(control.JournalRead)[0].limit == 5
        robot.answer_to = lambda message: (
            [control.Refusal(label="_mosaic", code="auth.forbidden")]
            if isinstance(message, control.JournalRead)
            else []
        )
        with pytest.raises(LeaseDenied) as denied:
            await connection.control.journal()
        assert denied.value.code == "auth.forbidden"


async def test_the_robots_pings_are_answered_with_our_clock(world: Any) -> None:
    hour_us = 3_600_000_000

    async with with_connection(world, clock_us=lambda: time.monotonic_ns() // 1000 + hour_us) as (robot, _connection):
        robot.say(control.Ping(t0=123))
        pong = robot.said(control.Pong)[0]
        assert pong.t0 == 123
        assert pong.t1 <= pong.t2
        assert abs(pong.t2 - hour_us - time.monotonic_ns() // 1000) < 60_000_000


async def test_a_ping_on_the_stop_channel_is_answered_there(world: Any) -> None:
    async with with_connection(world) as (robot, _connection):
        robot.channels[control.STOP_LABEL].deliver(control.Ping(t0=9).to_text().encode())
        assert [pong.t0 for pong in robot.pongs_on_stop_channel] == [9]
        assert robot.said(control.Pong) == []


async def test_a_program_says_that_it_is_one_and_a_person_too(world: Any) -> None:
    for is_person in (False, True):
        async with with_connection(world, is_person=is_person) as (robot, _connection):
            assert robot.said(control.Hello)[-1].is_person == is_person


async def test_peers_limits_and_changes_are_told_though_a_listener_fails(world: Any) -> None:
    async with with_connection(world) as (robot, connection):
        told: list[float] = []

        def broken() -> None:
            raise RuntimeError("a listener")

        connection.control.on_change(broken)
        end = connection.control.on_change(lambda: told.append(1))
        robot.say(control.Peers(you=world.peer_id, peers=(control.PeerInfo(peer_id="bob", name="Bob"),)))
        robot.say(control.SafetyLimit(label="cmd_vel", factor=0.5))
        end()
        robot.say(control.SafetyLimit(label="cmd_vel", factor=0.4))
        assert len(told) == 2
        assert [peer.name for peer in connection.control.peers] == ["Bob"]
        assert connection.control.limits["cmd_vel"].factor == 0.4
        await connection.control.wait_for(lambda: connection.control.peers, 30.0)


async def test_the_stop_channel_loses_rather_than_delays(world: Any) -> None:
    async with with_connection(world) as (robot, connection):
        channel = robot.channels["_stop"]
        assert (channel.ordered, channel.max_retransmits, channel.protocol) == (False, 0, "mosaic.1")
        channel.buffered_bytes = robot.channels["_mosaic"].buffered_bytes = 10_000_000
        robot.answer_to = stop_acks()
        assert (await connection.control.stop()).is_safe
        assert json.loads(channel.frames()[0].payload)["type"] == "stop"


async def test_the_age_of_what_a_program_looks_at_is_reported_ten_times_a_second_at_most(world: Any) -> None:
    async with with_connection(world) as (robot, connection):
        pictures = robot.videos["front"].queue
        front = connection.media("front")
        pictures.put_nowait(90_000)  # no origin is known yet: nothing to report
        await front.next_frame(WAIT_S)
        robot.say(control.MediaOrigin(label="front", ssrc=1, rtp_origin=1000, boot_id="boot"))
        for timestamp in (1000 + 90 * 4_990, 1000 + 90 * 4_995):
            pictures.put_nowait(timestamp)
            await front.next_frame(WAIT_S)
        # the fake robot's clock stands at five seconds
        assert [(seen.label, seen.capture_us) for seen in robot.said(control.MediaSeen)] == [("front", 4_990_000)]


async def test_without_a_camera_in_use_nothing_is_reported(world: Any) -> None:
    async with with_connection(world) as (robot, _connection):
        robot.say(control.MediaOrigin(label="front", ssrc=1, rtp_origin=0, boot_id="boot"))
        robot.videos["front"].queue.put_nowait(90)
        await until(lambda: robot.videos["front"].queue.empty())
        assert robot.said(control.MediaSeen) == []
