"""The fence with real threads: a command that arrived before a stop or a change of the lease never acts after it."""

from __future__ import annotations

import random
import sys
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

import pytest
from support.waiting import wait_for

from mosaic_core import Sender
from mosaic_core.machines.control.lease_desk import LeaseDesk
from mosaic_core.machines.control.lease_events import Kept, Party, PartyJoined, PartyLeft, Released, Requested
from mosaic_core.machines.control.stop_latch import StopLatch
from mosaic_core.runtime.commands.fence import SAFE, Fence
from mosaic_core.runtime.commands.inbox import Incoming
from mosaic_core.runtime.commands.safety_watch import GONE, SafetyWatch
from mosaic_core.runtime.commands.safety_watchdog import SafetyWatchdog
from mosaic_core.runtime.configuration.receiver_safety import ReceiverSafety

PATIENCE_S = 30.0
PEERS = ("ann", "bob")
ROUNDS = 600
SOON_S = 0.2
"""More than a stop takes that nobody keeps waiting."""


@dataclass
class Mover:
    """Moves for whoever was handled last, until it is made safe."""

    mover: str | None = None
    safe_actions: int = 0

    def make_safe(self, cause: str) -> None:
        self.mover = None
        self.safe_actions += 1


@dataclass
class Scene:
    safety: SafetyWatchdog
    fence: Fence
    watch: SafetyWatch
    motor: Mover
    openings: dict[str, int] = field(default_factory=dict)
    told: list[Any] = field(default_factory=list)
    stops: int = 0

    def item(self, peer_id: str) -> Incoming:
        """A command that arrives now, as its sender's newest channel and lease have it."""
        with self.fence.lock:
            epoch = self.fence.desk.epoch("motion") if self.holder == peer_id else 0
            return Incoming(
                "drive", b"", Sender(peer_id, peer_id), 1, 0.0, epoch, self.openings[peer_id], self.watch.generation
            )

    @property
    def holder(self) -> str | None:
        with self.fence.lock:
            holder = self.fence.desk.holder("motion")
            return holder.peer_id if holder else None

    def handle(self, item: Incoming, meanwhile: Callable[[], object] = lambda: None) -> str | None:
        """What the receiver's thread does with a command; ``meanwhile`` happens within ``handle_data``."""
        code = self.watch.begin(item)
        if code is None:
            meanwhile()
            self.motor.mover = item.sender.peer_id
            self.watch.finish(accepted=True)
        return code

    def settle(self) -> None:
        with self.safety.changed:
            assert self.safety.changed.wait_for(lambda: not self.watch.is_unsettled, PATIENCE_S)

    def take(self, peer_id: str) -> None:
        self.fence.handle(Requested(peer_id, "motion", "because", force=True))
        assert self.holder == peer_id

    def stop(self) -> None:
        self.stops += 1
        self.fence.stop("somebody", "", str(self.stops))

    def clear(self) -> None:
        with self.fence.lock:
            assert self.fence.latch.clear(Party("boss", "boss", role="supervisor", is_person=True), False) is None

    def rejoin(self, peer_id: str) -> None:
        self.watch.peer_left(Sender(peer_id, peer_id))
        self.openings[peer_id] = self.watch.peer_joined(peer_id)


@pytest.fixture
def restless_threads() -> Iterator[None]:
    """Python changes between threads far more often than usual; yet more often, and it does little else."""
    usual_s = sys.getswitchinterval()
    sys.setswitchinterval(1e-4)
    yield
    sys.setswitchinterval(usual_s)


@pytest.fixture
def scene() -> Iterator[Scene]:
    safety, motor = SafetyWatchdog(), Mover()
    told: list[Any] = []
    fence = Fence(safety, LeaseDesk(["motion"], expiry_s=60.0), StopLatch(), told.append)
    leased = ReceiverSafety(timeout_s=60.0, resource="motion")
    watch = safety.guard("drive", leased, motor.make_safe, lambda sender: None)
    safety.start()
    it = Scene(safety, fence, watch, motor, told=told)
    for peer_id in PEERS:
        fence.handle(PartyJoined(Party(peer_id, peer_id, peer_id, "supervisor", is_person=True)))
        it.openings[peer_id] = watch.peer_joined(peer_id)
    yield it
    safety.close()


CHANGES: dict[str, Callable[[Scene], object]] = {
    "stop": lambda scene: scene.stop(),
    "stop and clear": lambda scene: (scene.stop(), scene.clear()),
    "take-over": lambda scene: scene.take("bob"),
    "take-over and back": lambda scene: (scene.take("bob"), scene.take("ann")),
    "release": lambda scene: scene.fence.handle(Released("ann", "motion")),
    "leaving": lambda scene: scene.fence.handle(PartyLeft("ann", on_purpose=True)),
    "reopened channel": lambda scene: scene.rejoin("ann"),
}


@pytest.mark.parametrize("change", CHANGES)
def test_what_arrived_before_a_change_never_begins_after_it(scene: Scene, change: str) -> None:
    scene.take("ann")
    item = scene.item("ann")
    CHANGES[change](scene)
    assert scene.handle(item) is not None
    assert scene.motor.mover is None


@pytest.mark.parametrize("change", CHANGES)
def test_what_acts_while_it_changes_is_made_safe_after_it(scene: Scene, change: str) -> None:
    scene.take("ann")
    before = scene.motor.safe_actions
    assert scene.handle(scene.item("ann"), lambda: CHANGES[change](scene)) is None
    scene.settle()
    assert scene.motor.mover is None
    assert scene.motor.safe_actions >= before + 1


@pytest.mark.parametrize("change", CHANGES)
def test_what_acted_before_a_change_is_made_safe_by_it(scene: Scene, change: str) -> None:
    scene.take("ann")
    assert scene.handle(scene.item("ann")) is None
    assert scene.motor.mover == "ann"
    CHANGES[change](scene)
    scene.settle()
    assert scene.motor.mover is None


def _race(scene: Scene, item: Incoming, change: Callable[[Scene], object], lead: int) -> str | None:
    """A command and a change at the same time, on two threads, one of them ahead by ``lead`` steps; what became of the
    command."""
    start = threading.Barrier(2)
    outcome: list[str | None] = []

    def command() -> None:
        start.wait(PATIENCE_S)
        sum(range(-lead))
        outcome.append(scene.handle(item))

    thread = threading.Thread(target=command)
    thread.start()
    start.wait(PATIENCE_S)
    sum(range(lead))
    change(scene)
    thread.join(PATIENCE_S)
    scene.settle()
    return outcome[0]


@pytest.mark.usefixtures("restless_threads")
def test_however_a_command_and_a_change_race_nothing_moves_in_the_end(scene: Scene) -> None:
    chance = random.Random(7)
    outcomes: set[bool] = set()
    for _ in range(ROUNDS):
        scene.fence.handle(PartyJoined(Party("ann", "ann", "ann", "supervisor", is_person=True)))
        scene.take("ann")
        name = chance.choice(list(CHANGES))
        item = scene.item("ann")
        scene.watch.paused(item)  # lets go: else nothing of theirs moves once it was stopped
        outcomes.add(_race(scene, item, CHANGES[name], chance.randrange(-9000, 60_000)) is None)
        assert scene.motor.mover is None, name
        if scene.fence.latch.is_stopped:
            scene.clear()
    assert outcomes == {True, False}  # both orders were seen


def test_no_stop_comes_between_the_question_and_the_command(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    """A stop of just that moment waits, and makes safe what the command has begun."""
    ask = SafetyWatch._refusal
    stopping = threading.Thread(target=scene.stop)

    def asked(watch: SafetyWatch, item: Incoming, now_s: float) -> str | None:
        answer = ask(watch, item, now_s)
        stopping.start()
        stopping.join(SOON_S)  # it can't end: whoever asks holds the lock
        return answer

    monkeypatch.setattr(SafetyWatch, "_refusal", asked)
    scene.take("ann")
    scene.handle(scene.item("ann"))
    stopping.join(PATIENCE_S)
    scene.settle()
    assert scene.motor.mover is None


@pytest.mark.parametrize("guard", ["_refusal", "_fence", "lease_lost", "stop"])
def test_without_its_guards_the_fence_would_leak(scene: Scene, monkeypatch: pytest.MonkeyPatch, guard: str) -> None:
    """The tests above would notice: with any guard taken out, something moves that must not."""
    monkeypatch.setattr(SafetyWatch, guard, lambda *_: None)
    leaks = []
    for change in CHANGES.values():
        for when in ("before", "after"):
            scene.fence.handle(PartyJoined(Party("ann", "ann", "ann", "supervisor", is_person=True)))
            scene.take("ann")
            item = scene.item("ann")
            if when == "before":
                change(scene)
                scene.settle()
                scene.handle(item)
            else:
                scene.handle(item)
                change(scene)
            scene.settle()
            leaks.append(scene.motor.mover is not None)
            scene.watch.make_safe("safety.shutdown")
            scene.settle()
            if scene.fence.latch.is_stopped:
                scene.clear()
    assert any(leaks)


def test_an_idle_command_keeps_the_lease_and_moves_nothing(scene: Scene) -> None:
    scene.take("ann")
    scene.handle(scene.item("ann"))
    assert scene.watch.begin(scene.item("ann"), is_idle=True) is None
    assert scene.watch.mover is None
    assert scene.watch.watchdog.due_at_s is None


def test_a_keep_alive_of_somebody_else_keeps_nothing(scene: Scene) -> None:
    scene.take("ann")
    due_s = scene.fence.due_at_s
    scene.fence.handle(Kept("bob", {"motion": scene.fence.desk.epoch("motion")}))
    assert scene.fence.due_at_s == due_s


def test_a_message_of_a_reopened_channel_is_nobodys(scene: Scene) -> None:
    scene.take("ann")
    item = scene.item("ann")
    scene.rejoin("ann")
    assert scene.watch.begin(item) == GONE
    assert scene.watch.begin(scene.item("ann")) is None


def test_a_hanging_farewell_keeps_no_safe_action_waiting() -> None:
    safety, motor = SafetyWatchdog(), Mover()
    hangs, entered = threading.Event(), threading.Event()

    def peer_left(sender: Sender) -> None:
        entered.set()
        hangs.wait(PATIENCE_S)

    watch = safety.guard("drive", ReceiverSafety(timeout_s=60.0), motor.make_safe, peer_left)
    safety.start()
    try:
        watch.peer_joined("ann")
        watch.peer_left(Sender("ann", "ann"))
        assert entered.wait(PATIENCE_S)
        watch.make_safe("safety.stop")
        with safety.changed:
            assert safety.changed.wait_for(lambda: motor.safe_actions == 1, PATIENCE_S)
        assert not hangs.is_set()
    finally:
        hangs.set()
        safety.close()


def test_a_stop_is_told_safe_by_its_own_safe_action_and_not_by_one_that_began_before() -> None:
    safety, told = SafetyWatchdog(), list[Any]()
    gates = [threading.Event(), threading.Event()]
    entered: list[str] = []

    def make_safe(cause: str) -> None:
        entered.append(cause)
        gates[len(entered) - 1].wait(PATIENCE_S)

    fence = Fence(safety, LeaseDesk(["motion"]), StopLatch(), told.append)
    watch = safety.guard("drive", ReceiverSafety(timeout_s=60.0), make_safe, lambda sender: None)
    safety.start()

    try:
        watch.make_safe("safety.timeout")
        wait_for(lambda: entered == ["safety.timeout"], "the first safe action begins")
        fence.stop("ann", "", "s1")
        gates[0].set()
        wait_for(lambda: entered == ["safety.timeout", "safety.stop"], "the second begins")
        with fence.lock:
            times = fence.latch.times("s1")
        assert times is not None
        assert times.safe_s is None, "the stop's own safe action still runs"
        gates[1].set()
        wait_for(lambda: told == [SAFE], "the end is told")
    finally:
        for gate in gates:
            gate.set()
        safety.close()
