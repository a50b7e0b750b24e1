"""The lease on the robot, end to end in memory: whose commands act, and what an end of the lease stops."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import AsyncIterator, Callable, Coroutine
from contextlib import asynccontextmanager
from typing import Any, ClassVar

from mosaic_core import DataChannelJsonReceivable
from mosaic_core.words import control
from mosaic_core.words.data_type import Delivery

PATIENCE_S = 3.0


class Arm(DataChannelJsonReceivable):
    """``log``: what it was told and why it was made safe. Clear ``free`` to let ``handle_data`` hang."""

    timeout_s = 30.0
    requires_lease = True

    def __init__(self, label: str = "drive") -> None:
        super().__init__(label)
        self.log: list[Any] = []
        self.free = threading.Event()
        self.free.set()

    def handle_data(self, data: dict[str, Any]) -> None:
        self.log.append(data["v"])
        self.free.wait(PATIENCE_S)

    def make_safe(self, cause: str) -> None:
        self.log.append(cause)


Body = Callable[[Any, Arm], Coroutine[Any, Any, None]]


@asynccontextmanager
async def played(
    kit: Any, *, config: dict[str, Any] | None = None, delivery: Delivery = Delivery.LATEST
) -> AsyncIterator[Any]:
    arm = Arm()
    async with kit.running(kit.connector_of(arm, delivery=delivery), control=config) as scene:
        try:
            yield scene, arm
        finally:
            arm.free.set()


async def test_without_the_lease_nothing_acts_and_with_it_everything_does(kit: Any) -> None:
    async with played(kit) as (scene, arm):
        ann = await scene.enters("ann")
        drive = ann.open("drive")
        drive.say({"v": "none"})
        await ann.hears("refusal")
        assert ann.codes() == ["lease.required"]
        epoch = await ann.take()
        drive.say({"v": 1}, epoch=epoch)
        await kit.until(lambda: arm.log == [1])
        state = (await ann.hears("lease.state", 2)).holder
        assert (state.name, state.is_person) == ("ann", True)
        assert scene.hooks.of("lease") == [{"resource": "motion", "holder": "ann", "epoch": epoch, "cause": ""}]


async def test_of_two_operators_who_fight_only_the_holder_moves_it(kit: Any) -> None:
    async with played(kit, delivery=Delivery.RELIABLE) as (scene, arm):
        ann, bob = await scene.enters("ann"), await scene.enters("bob")
        drives = {"ann": ann.open("drive"), "bob": bob.open("drive")}
        await ann.take()
        for round_number in range(8):
            holder, other = (ann, bob) if round_number % 2 == 0 else (bob, ann)
            names = ("ann", "bob") if round_number % 2 == 0 else ("bob", "ann")
            drives[names[0]].say({"v": (names[0], round_number)}, epoch=holder.epoch)
            drives[names[1]].say({"v": "thief"}, epoch=holder.epoch)
            drives[names[1]].say({"v": "late"}, epoch=other.epoch)
            await kit.until(lambda number=round_number: [n for n in arm.log if isinstance(n, list)][number:])
            other.say(control.LeaseRequest())
            await kit.until(lambda who=holder: (who.heard("lease.state")[-1]).queue)
            holder.say(control.LeaseAnswer(peer_id=other.peer_id, grant=True))
            await kit.until(lambda who=other: who.heard("lease.reply")[-1].outcome == "granted")
            other.epoch = other.heard("lease.reply")[-1].epoch
        told = [entry for entry in arm.log if isinstance(entry, list)]
        assert told == [[("ann", "bob")[number % 2], number] for number in range(8)]
        assert not {"thief", "late"} & {entry for entry in arm.log if isinstance(entry, str)}
        assert {"lease.not_holder"} <= {*ann.codes(), *bob.codes()}


async def test_a_takeover_in_the_middle_of_a_command_makes_it_safe_and_drops_what_is_queued(kit: Any) -> None:
    async with played(kit, delivery=Delivery.RELIABLE) as (scene, arm):
        ann, boss = await scene.enters("ann"), await scene.enters("boss", role="supervisor")
        drive, epoch = ann.open("drive"), await ann.take()
        arm.free.clear()
        drive.say({"v": 1}, epoch=epoch)
        await kit.until(lambda: arm.log == [1])
        drive.say({"v": "queued"}, epoch=epoch)
        drive.say({"v": "queued too"}, epoch=epoch)
        await boss.take(force=True, reason="it heads for the stairs")
        await kit.until(lambda: arm.log == [1, "safety.lease_lost"])
        arm.free.set()
        await kit.until(lambda: arm.log == [1, "safety.lease_lost", "safety.lease_lost"])
        ended = ann.heard("lease.reply")[-1]
        assert (ended.outcome, ended.code, ended.message) == ("ended", "lease.taken_over", "it heads for the stairs")
        drive.say({"v": "old epoch"}, epoch=epoch)
        await kit.until(lambda: "lease.not_holder" in ann.codes())
        boss.open("drive").say({"v": 2}, epoch=boss.epoch)
        await kit.until(lambda: arm.log[-1] == 2)
        assert arm.log == [1, "safety.lease_lost", "safety.lease_lost", 2]


async def test_a_silent_holder_loses_the_lease_even_while_the_event_loop_stands_still(kit: Any) -> None:
    async with played(kit, config={"lease_expiry_s": 0.5}) as (scene, arm):
        ann, bob = await scene.enters("ann"), await scene.enters("bob")
        drive, epoch = ann.open("drive"), await ann.take()
        drive.say({"v": 1}, epoch=epoch)
        await kit.until(lambda: arm.log == [1])
        stopped = threading.Event()
        watching = threading.Thread(target=lambda: _wait_for(lambda: len(arm.log) > 1, stopped))
        watching.start()
        watching.join(PATIENCE_S)  # the loop is blocked: only the safety threads go on
        assert stopped.is_set()
        assert arm.log == [1, "safety.lease_lost"]
        drive.say({"v": 2}, epoch=epoch)
        await kit.until(lambda: "ended" in [reply.outcome for reply in ann.heard("lease.reply")])
        assert ann.heard("lease.reply")[-1].code == "lease.expired"
        assert (await bob.hears("lease.state", 3)).holder is None
        assert arm.log == [1, "safety.lease_lost"]


def _wait_for(condition: Callable[[], bool], seen: threading.Event) -> None:
    end = threading.Event()
    for _ in range(int(PATIENCE_S / 0.005)):
        if condition():
            seen.set()
            return
        end.wait(0.005)


async def test_keep_alives_and_commands_hold_the_lease(kit: Any) -> None:
    async with played(kit, config={"lease_expiry_s": 0.5}) as (scene, _arm):
        ann = await scene.enters("ann")
        epoch = await ann.take()
        for _ in range(8):
            await asyncio.sleep(0.1)
            ann.say(control.LeaseKeep(epochs={"motion": epoch}))
        drive = ann.open("drive")
        for number in range(8):
            await asyncio.sleep(0.1)
            drive.say({"v": number}, epoch=epoch)
        assert ann.heard("lease.state")[-1].epoch == epoch
        await asyncio.sleep(0.0)
        assert "lease.expired" not in ann.codes("lease.reply")


async def test_the_same_session_comes_back_to_its_lease_with_a_new_epoch(kit: Any) -> None:
    async with played(kit) as (scene, arm):
        ann, bob = await scene.enters("ann", session_id="s"), await scene.enters("bob")
        drive, old = ann.open("drive"), await ann.take()
        drive.say({"v": 1}, epoch=old)
        await kit.until(lambda: arm.log == [1])
        back = await scene.enters("ann", session_id="s")  # its old peer connection is replaced
        await kit.until(lambda: ann.end.is_closed)
        assert bob.heard("lease.state")[-1].holder.name == "ann"
        new = await back.take()
        assert new != old
        again = back.open("drive")
        again.say({"v": "old epoch"}, epoch=old)
        await kit.until(lambda: back.codes() == ["lease.old_epoch"])
        again.say({"v": 2}, epoch=new)
        await kit.until(lambda: arm.log[-1] == 2)
        assert "old epoch" not in arm.log
        assert arm.log.count("safety.peer_left") == 1


async def test_a_person_takes_it_from_a_program_and_a_program_waits_for_no_person(kit: Any) -> None:
    async with played(kit) as (scene, arm):
        robot_program = await scene.enters("bot", is_person=False)
        claims_to_be = await scene.enters("claims", is_person=True, is_program=True)
        ann = await scene.enters("ann")
        await robot_program.take()
        drive = robot_program.open("drive")
        drive.say({"v": 1}, epoch=robot_program.epoch)
        await kit.until(lambda: arm.log == [1])
        await ann.take()
        await kit.until(lambda: arm.log == [1, "safety.lease_lost"])
        assert robot_program.heard("lease.reply")[-1].code == "lease.preempted"
        claims_to_be.say(control.LeaseRequest())
        reply = await claims_to_be.hears("lease.reply")
        assert (reply.outcome, reply.code) == ("denied", "lease.person_commands")
        peers = {info.name: info.is_person for info in ann.heard("peers")[-1].peers}
        assert peers == {"bot": False, "claims": False, "ann": True}


async def test_observers_command_nothing_but_what_takes_observers(kit: Any) -> None:
    class Echo(Arm):
        timeout_s = None
        requires_lease = False
        takes_observers: ClassVar[bool] = True

    class Plain(Arm):
        timeout_s = None
        requires_lease = False

    arm, echo, plain = Arm("drive"), Echo("echo"), Plain("plain")

    async with kit.running(*map(kit.connector_of, (arm, echo, plain))) as scene:
        eve = await scene.enters("eve", role="observer")
        for label in ("drive", "echo", "plain"):
            eve.open(label).say({"v": label})
        await kit.until(lambda: echo.log == ["echo"] and len(eve.codes()) == 2)
        assert eve.codes() == ["lease.forbidden", "lease.forbidden"]
        eve.say(control.LeaseRequest())
        assert (await eve.hears("lease.reply")).code == "lease.forbidden"
        assert arm.log == plain.log == []


async def test_a_resource_of_its_own_is_leased_apart(kit: Any) -> None:
    base, gripper = Arm("base"), Arm("gripper")

    connectors = (kit.connector_of(base), kit.connector_of(gripper, safety={"resource": "arm"}))
    async with kit.running(*connectors) as scene:
        ann, bob = await scene.enters("ann"), await scene.enters("bob")
        await ann.take("motion")
        await bob.take("arm")
        ann.open("base").say({"v": 1}, epoch=ann.epoch)
        bob.open("gripper").say({"v": 2}, epoch=bob.epoch)
        await kit.until(lambda: base.log == [1] and gripper.log == [2])
        bob.open("base").say({"v": "thief"}, epoch=bob.epoch)
        await kit.until(lambda: bob.codes() == ["lease.not_holder"])
        bob.leave()
        await kit.until(lambda: len(gripper.log) > 1)
        assert base.log == [1]
        leases = {lease.resource: lease.holder for lease in scene.robot.snapshot().leases}
        assert leases == {"motion": "ann", "arm": ""}


async def test_a_lease_that_ends_stops_only_what_its_holder_moved(kit: Any) -> None:
    async with played(kit) as (scene, arm):
        ann = await scene.enters("ann")
        await ann.take()
        ann.say(control.LeaseRelease())
        await kit.until(lambda: ann.codes("lease.reply")[-1:] == ["lease.released"])
        assert arm.log == []
