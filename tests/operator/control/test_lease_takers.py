"""The robot's answers about leases reach whoever asked in this program, and what nobody wants is given up."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass, field

import pytest

from mosaic_core.machines.control.operator_control import Denied, Granted, Lost, Queued
from mosaic_core.operator.control import lease_takers
from mosaic_core.operator.control.lease import Lease, LeaseDenied
from mosaic_core.operator.control.lease_takers import LeaseTakers
from mosaic_core.words.errors import ConnectionFailed

LONG_S = 60.0


@dataclass
class Desk:
    """``asked`` and ``given_up``: what the robot would be told."""

    asked: int = 0
    given_up: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.takers = LeaseTakers(self.given_up.append)

    def ask(self) -> None:
        self.asked += 1

    async def asking(self, resource: str = "motion", wait_s: float = LONG_S) -> asyncio.Task[Lease]:
        """A task that has asked and waits."""
        task = asyncio.create_task(self.takers.take(resource, self.ask, wait_s))
        await turns()
        return task

    async def taken(self, resource: str = "motion", epoch: int = 7) -> Lease:
        task = await self.asking(resource)
        self.takers.decided(Granted(resource, epoch))
        return await task


async def turns() -> None:
    for _ in range(5):
        await asyncio.sleep(0)


async def test_a_grant_goes_to_who_asked_for_this_resource() -> None:
    desk = Desk()
    motion, arm = await desk.asking("motion"), await desk.asking("arm")
    assert desk.asked == 2
    desk.takers.decided(Granted("motion", 7))
    lease = await motion
    assert (lease.resource, lease.epoch, lease.is_held) == ("motion", 7, True)
    assert not arm.done()
    desk.takers.decided(Granted("arm", 8))
    assert (await arm).epoch == 8
    assert desk.given_up == []


async def test_all_who_wait_for_a_resource_have_the_grant() -> None:
    desk = Desk()
    tasks = [await desk.asking(), await desk.asking()]
    desk.takers.decided(Granted("motion", 7))
    leases = await asyncio.gather(*tasks)
    assert leases[0] is not leases[1]
    assert desk.takers.held_for_long() == leases


async def test_a_denial_is_raised_with_the_robots_words_and_the_resource_is_given_up() -> None:
    desk = Desk()
    task = await desk.asking()
    desk.takers.decided(Denied("motion", "lease.person_commands", "Anna drives"))
    with pytest.raises(LeaseDenied, match="Anna drives") as denied:
        await task
    assert (denied.value.code, denied.value.resource) == ("lease.person_commands", "motion")
    assert desk.given_up == ["motion"]


async def test_who_asks_and_fails_to_leaves_nothing_behind() -> None:
    desk = Desk()

    def broken() -> None:
        raise ConnectionFailed("gone", code="channel.timeout")

    with pytest.raises(ConnectionFailed):
        await desk.takers.take("motion", broken, LONG_S)
    desk.takers.decided(Granted("motion", 7))
    assert desk.takers.held_for_long() == []
    assert desk.given_up == ["motion"]


async def test_a_robot_that_does_not_answer_knows_no_leases(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lease_takers, "ANSWER_S", 0.0)
    desk = Desk()
    with pytest.raises(ConnectionFailed, match="does not answer") as failed:
        await desk.takers.take("motion", desk.ask, LONG_S)
    assert failed.value.code == "channel.timeout"
    assert desk.given_up == ["motion"]


async def test_who_stands_in_the_queue_waits_as_long_as_it_said_and_then_hears_why() -> None:
    desk = Desk()
    task = await desk.asking(wait_s=0.0)
    desk.takers.decided(Queued("motion", "Anna drives"))
    with pytest.raises(LeaseDenied, match="Anna drives") as denied:
        await task
    assert denied.value.code == "lease.queued"
    assert desk.given_up == ["motion"]


async def test_who_waits_in_the_queue_gets_the_lease_when_it_is_its_turn() -> None:
    desk = Desk()
    task = await desk.asking()
    desk.takers.decided(Queued("motion"))
    await turns()
    assert not task.done()
    desk.takers.decided(Granted("motion", 7))
    assert (await task).epoch == 7


async def test_who_is_cancelled_gives_up_unless_somebody_else_still_waits() -> None:
    desk = Desk()
    one, other = await desk.asking(), await desk.asking()
    one.cancel()
    await turns()
    assert desk.given_up == []
    other.cancel()
    await turns()
    assert desk.given_up == ["motion"]


async def test_a_grant_that_comes_while_its_taker_is_cancelled_is_given_up() -> None:
    desk = Desk()
    task = await desk.asking()
    task.cancel()
    desk.takers.decided(Granted("motion", 7))
    with pytest.raises(asyncio.CancelledError):
        await task
    assert desk.takers.held_for_long() == []
    assert desk.given_up == ["motion"]


async def test_a_lost_lease_ends_with_the_robots_code_and_only_its_own_resource() -> None:
    desk = Desk()
    motion, arm = await desk.taken("motion"), await desk.taken("arm")
    desk.takers.decided(Lost("motion", "lease.taken_over", "smoke"))
    assert motion.lost is not None
    assert (motion.lost.code, motion.lost.resource, str(motion.lost)) == ("lease.taken_over", "motion", "smoke")
    assert arm.is_held
    assert desk.takers.held_for_long() == [arm]
    motion.release()
    assert desk.given_up == [], "what is lost is not given back"


async def test_one_who_gives_back_gives_back_for_all_of_this_program() -> None:
    desk = Desk()
    tasks = [await desk.asking(), await desk.asking()]
    desk.takers.decided(Granted("motion", 7))
    one, other = await asyncio.gather(*tasks)
    one.release()
    assert (other.is_held, other.lost) == (False, None)
    assert desk.given_up == ["motion"]
    other.release()
    assert desk.given_up == ["motion"]


async def test_only_leases_outside_of_blocks_are_held_for_long() -> None:
    desk = Desk()
    lease = await desk.taken()
    async with lease:
        assert desk.takers.held_for_long() == []
    other = await desk.taken()
    assert desk.takers.held_for_long() == [other]


async def test_lost_leases_are_held_again_in_place_of_the_new_one() -> None:
    desk = Desk()
    lease = await desk.taken(epoch=7)
    desk.takers.decided(Lost("motion", "lease.expired"))
    again = await desk.taken(epoch=9)
    desk.takers.regained([lease], again)
    assert (lease.is_held, lease.epoch) == (True, 9)
    assert desk.takers.held_for_long() == [lease]
    lease.release()
    assert desk.given_up == ["motion"]


async def test_what_was_lost_again_meanwhile_is_not_regained() -> None:
    desk = Desk()
    lease = await desk.taken(epoch=7)
    desk.takers.decided(Lost("motion", "lease.expired"))
    again = await desk.taken(epoch=9)
    desk.takers.decided(Lost("motion", "lease.expired"))
    desk.takers.regained([lease], again)
    assert (lease.is_held, lease.epoch) == (False, 7)
    assert desk.takers.held_for_long() == []
