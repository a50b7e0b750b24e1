"""One watch by itself: no thread runs and the clock stands, so each rule of overtaking and silence is seen alone."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

import pytest

from mosaic_core.contract.host import Sender
from mosaic_core.machines.commands.admission import OVERTAKEN
from mosaic_core.runtime.commands import safety_watch
from mosaic_core.runtime.commands.inbox import Incoming
from mosaic_core.runtime.commands.safety_watch import (
    GONE,
    MAX_FAREWELLS,
    RESTOP_S,
    ZEROS_FOR_S,
    SafetyWatch,
)
from mosaic_core.runtime.configuration.receiver_safety import ReceiverSafety

ANN, BOB = Sender("a", "session-a"), Sender("b", "session-b")
DRIVE = ReceiverSafety(timeout_s=0.5, resource="motion")


class FakeFence:
    """Refuses what it is told to, and notes what it hears."""

    due_at_s = None

    def __init__(self) -> None:
        self.is_stopped = False
        self.refuses: str | None = None
        self.asked: list[tuple[Any, ...]] = []
        self.heard: list[tuple[Any, ...]] = []

    def refusal(
        self, safety: ReceiverSafety, peer_id: str, epoch: int | None, now_s: float | None = None
    ) -> str | None:
        self.asked.append((safety, peer_id, epoch, now_s))
        return self.refuses

    def commanded(self, safety: ReceiverSafety, peer_id: str, now_s: float) -> None:
        self.heard.append((safety, peer_id, now_s))

    def made_safe(self, watch: SafetyWatch) -> None:
        self.heard.append(("safe", watch))

    def expire(self, now_s: float) -> None: ...


class Bell(threading.Condition):
    """Counts how often the safety threads are woken."""

    rung = 0

    def notify_all(self) -> None:
        self.rung += 1
        super().notify_all()


class Owner:
    def __init__(self) -> None:
        self.changed = Bell()
        self.fence: FakeFence | None = FakeFence()
        self.is_closed = False
        self.moved: list[float | None] = []

    def deadline_moved(self, due_s: float | None) -> None:
        self.moved.append(due_s)


class Scene:
    """A watch; what its safe actions were called with, and a device that may fail."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, safety: ReceiverSafety = DRIVE) -> None:
        self.now_s = 100.0
        monkeypatch.setattr(safety_watch.time, "monotonic", lambda: self.now_s)
        self.owner = Owner()
        self.causes: list[str] = []
        self.left: list[Sender] = []
        self.fails = False
        self.woken = 0
        self.dropped: list[str | None] = []
        self.watch = SafetyWatch(self.owner, "drive", safety, self._make_safe, self.left.append)
        self.watch.dropped = self.dropped.append
        self.watch.woken = self._wake
        self.openings = {one.peer_id: self.watch.peer_joined(one.peer_id, one.session_id) for one in (ANN, BOB)}

    @property
    def fence(self) -> FakeFence:
        assert self.owner.fence is not None
        return self.owner.fence

    def _make_safe(self, cause: str) -> None:
        self.causes.append(cause)
        if self.fails:
            raise OSError("the bus is gone")

    def _wake(self) -> None:
        self.woken += 1

    def command(self, sender: Sender = ANN, **how: Any) -> Incoming:
        known = {"opening": self.openings[sender.peer_id], "generation": self.watch.generation, "epoch": 7}
        return Incoming("drive", b"{}", sender, 1, self.now_s, **{**known, **how})

    def begins(self, sender: Sender = ANN, **how: Any) -> str | None:
        return self.watch.begin(self.command(sender), **how)

    def moves(self, sender: Sender = ANN) -> None:
        """A command that acts and has returned."""
        assert self.begins(sender) is None
        assert self.watch.finish(accepted=True) is None

    def runs(self) -> list[str]:
        """The safety thread runs what waits; the causes."""
        before = len(self.causes)
        while self.watch.actions:
            action = self.watch.actions.popleft()
            try:
                action()
            except OSError:
                continue
        return self.causes[before:]

    def stop(self) -> None:
        with self.owner.changed:
            self.watch.stop()

    def loses_lease(self, peer_id: str) -> None:
        with self.owner.changed:
            self.watch.lease_lost(peer_id)

    def expire(self) -> None:
        with self.owner.changed:
            self.watch.expire(self.now_s)


Make = Callable[..., Scene]


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch) -> Make:
    return lambda safety=DRIVE: Scene(monkeypatch, safety)


@pytest.fixture
def it(made: Make) -> Scene:
    return made()


# -- what may act


def test_who_has_left_or_opened_the_channel_anew_is_gone_and_nobody_else_is_asked(it: Scene) -> None:
    old = it.command()
    it.openings["a"] = it.watch.peer_joined("a", "session-a")
    assert it.watch.begin(old) == GONE
    it.watch.peer_left(BOB)
    assert it.begins(BOB) == GONE
    assert it.fence.asked == []
    assert it.begins(ANN) is None


def test_the_fence_is_asked_about_this_very_command_and_hears_that_it_acts(it: Scene) -> None:
    it.fence.refuses = "lease.not_holder"
    assert it.begins() == "lease.not_holder"
    assert it.fence.asked == [(DRIVE, "a", 7, 100.0)]
    assert it.fence.heard == []
    it.fence.refuses = None
    assert it.begins() is None
    assert it.fence.heard == [(DRIVE, "a", 100.0)]


def test_without_a_fence_everything_acts(it: Scene) -> None:
    it.owner.fence = None
    assert it.begins() is None
    it.watch.make_safe("safety.stop")
    assert it.watch.finish(accepted=True) == "safety.stop"
    assert it.runs() == ["safety.stop", "safety.stop"]
    assert it.watch.peer_joined("c") > max(it.openings.values())


def test_what_arrived_before_a_stop_or_the_loss_of_a_lease_is_refused_for_that(it: Scene) -> None:
    before = it.command()
    it.stop()
    assert it.watch.begin(before) == "safety.stopped"
    before = it.command()
    it.loses_lease("a")
    assert it.watch.begin(before) == "lease.old_epoch"
    it.fence.refuses = "lease.expired"
    assert it.watch.begin(before) == "lease.expired", "the fence knows better"
    assert it.dropped == [None, "a"]
    assert it.watch.generation == 2


def test_what_was_shaped_before_a_safe_action_is_overtaken(it: Scene) -> None:
    fired = it.watch.fired
    assert it.begins(fired=fired) is None
    it.watch.finish(accepted=True)
    it.watch.make_safe("safety.timeout")
    assert it.watch.fired == fired + 1
    assert it.begins(fired=fired) == OVERTAKEN
    assert it.begins(fired=fired + 1) is None


def test_a_command_arms_the_time_out_and_one_that_only_stands_disarms_it(it: Scene) -> None:
    it.moves()
    assert (it.watch.due_at_s, it.watch.mover) == (100.5, "a")
    assert it.owner.moved == [100.5]
    assert it.begins(is_idle=True) is None
    assert (it.watch.due_at_s, it.watch.mover) == (None, None)


def test_a_watch_that_nothing_has_happened_to_is_idle(made: Make) -> None:
    it = made()
    assert it.watch.label == "drive"
    assert it.watch.zeros_until_s is None
    assert it.watch.due_at_s is None
    assert not it.watch.is_parting
    assert it.watch.finish(accepted=False) is None
    assert it.runs() == []


def test_a_command_without_the_number_of_an_opening_or_with_that_of_another_stop_does_not_act(it: Scene) -> None:
    assert it.watch.begin(it.command(ANN, opening=0)) == GONE
    assert it.watch.begin(it.command(ANN, generation=5)) == "safety.stopped"


def test_a_watch_whose_receiver_does_not_listen_is_made_safe_all_the_same(made: Make) -> None:
    it = made(ReceiverSafety(timeout_s=0.5, on_timeout="zero"))
    it.watch = SafetyWatch(it.owner, "drive", it.watch.safety, it.causes.append, it.left.append)
    it.openings["a"] = it.watch.peer_joined("a", "session-a")
    it.stop()
    it.moves()
    it.now_s += 0.5
    it.expire()
    assert it.runs() == ["safety.stop", "safety.timeout"]


def test_the_watchdog_knows_who_commanded_last(it: Scene) -> None:
    it.moves(ANN)
    it.moves(BOB)
    assert not it.watch.watchdog.peer_left("a")
    assert it.watch.watchdog.peer_left("b")


# -- what was overtaken while it acted


def test_a_safe_action_that_overtook_a_command_runs_again_when_it_returns_and_meanwhile(it: Scene) -> None:
    assert it.begins() is None
    it.watch.make_safe("safety.stop")
    assert it.runs() == ["safety.stop"]
    assert it.watch.due_at_s == 100.0 + RESTOP_S
    it.expire()
    assert it.runs() == [], "not before its time"
    it.now_s += RESTOP_S
    it.expire()
    it.expire()
    assert it.runs() == ["safety.stop"]
    assert it.watch.due_at_s == pytest.approx(it.now_s + RESTOP_S)
    assert it.watch.finish(accepted=True) == "safety.stop"
    assert it.runs() == ["safety.stop"]
    assert it.watch.due_at_s is None
    it.now_s += 10 * RESTOP_S
    it.expire()
    assert it.runs() == []


def test_the_safety_threads_are_woken_for_every_action_and_farewell(it: Scene) -> None:
    assert it.begins() is None
    it.watch.make_safe("safety.stop")
    assert it.owner.changed.rung == 1
    it.runs()
    it.now_s += RESTOP_S
    it.expire()
    assert it.owner.changed.rung == 2
    it.watch.peer_left(BOB)
    assert it.owner.changed.rung == 3


@pytest.mark.parametrize("waits", ["acting", "queued"])
def test_a_safe_action_that_hangs_itself_is_not_repeated(it: Scene, waits: str) -> None:
    assert it.begins() is None
    it.watch.make_safe("safety.stop")
    if waits == "acting":
        it.watch.actions.clear()
        it.watch.is_acting = True
    before = len(it.watch.actions)
    it.now_s += RESTOP_S
    it.expire()
    assert len(it.watch.actions) == before
    assert it.watch.due_at_s == pytest.approx(it.now_s + RESTOP_S), "it is looked at again"


def test_a_command_that_returns_after_the_robot_has_stopped_is_made_safe_on_its_own_thread(it: Scene) -> None:
    assert it.begins() is None
    it.watch.make_safe("safety.shutdown")
    it.runs()
    it.owner.is_closed = True
    assert it.watch.finish(accepted=True) == "safety.shutdown"
    assert it.causes == ["safety.shutdown", "safety.shutdown"]
    assert not it.watch.actions
    assert it.watch.finish(accepted=True) is None, "told once"
    assert len(it.causes) == 2


def test_the_next_command_is_not_overtaken_by_what_overtook_the_last_one(it: Scene) -> None:
    assert it.begins() is None
    it.watch.make_safe("safety.timeout")
    assert it.watch.finish(accepted=False) == "safety.timeout"
    it.runs()
    assert it.begins() is None
    assert it.watch.finish(accepted=True) is None
    assert it.runs() == []


# -- commands that were refused after all


def test_a_refused_command_leaves_the_time_out_and_the_mover_as_they_were(it: Scene) -> None:
    it.moves(ANN)
    it.now_s += 0.2
    assert it.begins(BOB) is None
    assert it.watch.due_at_s == 100.7
    it.watch.finish(accepted=False)
    assert (it.watch.due_at_s, it.watch.mover) == (100.5, "a")
    assert it.owner.moved[-1] == 100.5


def test_a_command_that_broke_has_kept_nothing_alive_and_its_sender_may_still_move_it(it: Scene) -> None:
    it.moves(ANN)
    it.now_s += 0.2
    assert it.begins(BOB) is None
    it.watch.finish(accepted=False, failed=True)
    assert (it.watch.due_at_s, it.watch.mover) == (100.5, "b")
    assert it.owner.moved[-1] == 100.5


def test_a_first_command_that_was_refused_has_moved_nothing(it: Scene) -> None:
    assert it.begins() is None
    it.watch.finish(accepted=False)
    assert (it.watch.due_at_s, it.watch.mover) == (None, None)
    assert it.runs() == []


def test_a_refused_command_that_a_safe_action_overtook_gives_nothing_back(it: Scene) -> None:
    it.moves(ANN)
    assert it.begins(BOB) is None
    it.watch.make_safe("safety.stop")
    it.watch.finish(accepted=False)
    assert (it.watch.due_at_s, it.watch.mover) == (None, None)


def test_who_left_before_a_safe_action_overtook_the_command_of_another_causes_no_further_one(it: Scene) -> None:
    it.moves(ANN)
    assert it.begins(BOB) is None
    it.watch.peer_left(ANN)
    it.watch.make_safe("safety.stop")
    it.watch.finish(accepted=False)
    assert it.runs() == ["safety.stop", "safety.stop"]


def test_who_left_while_the_command_of_another_was_refused_is_made_safe_then(it: Scene) -> None:
    it.moves(ANN)
    assert it.begins(BOB) is None
    it.watch.peer_left(ANN)
    assert it.runs() == []
    it.watch.finish(accepted=False)
    assert it.runs() == ["safety.peer_left"]


# -- who leaves


def test_the_leaving_of_who_moves_it_or_acts_makes_it_safe_and_of_others_does_not(it: Scene) -> None:
    it.moves(ANN)
    it.watch.peer_left(BOB)
    assert it.runs() == []
    it.watch.peer_left(ANN)
    assert it.runs() == ["safety.peer_left"]
    for farewell in it.watch.farewells:
        farewell()
    assert it.left == [BOB, ANN]


def test_who_leaves_while_its_command_acts_is_made_safe_though_another_safe_action_ran(it: Scene) -> None:
    assert it.begins(ANN) is None
    it.watch.make_safe("safety.timeout")
    it.runs()
    it.watch.peer_left(ANN)
    assert it.runs() == ["safety.peer_left"]


def test_farewells_are_bounded(it: Scene) -> None:
    for _ in range(MAX_FAREWELLS + 5):
        it.watch.peer_left(BOB)
    assert len(it.watch.farewells) == MAX_FAREWELLS


@pytest.mark.parametrize(("policy", "causes"), [("callback", ["safety.peer_left"]), ("hold", [])])
def test_a_loss_follows_its_policy(made: Make, policy: Any, causes: list[str]) -> None:
    it = made(ReceiverSafety(timeout_s=0.5, on_loss=policy, on_timeout="zero"))
    it.moves()
    it.watch.peer_left(ANN)
    assert it.runs() == causes
    assert it.woken == 0


@pytest.mark.parametrize(("policy", "causes"), [("callback", ["safety.timeout"]), ("hold", [])])
def test_silence_follows_its_policy_once(made: Make, policy: Any, causes: list[str]) -> None:
    it = made(ReceiverSafety(timeout_s=0.5, on_timeout=policy))
    it.moves()
    it.now_s += 0.4
    it.expire()
    assert it.runs() == []
    it.now_s += 0.1
    it.expire()
    it.expire()
    assert it.runs() == causes
    assert it.woken == 0


def test_the_loss_of_a_lease_makes_safe_what_its_holder_moves_or_is_about_to(it: Scene) -> None:
    it.moves(ANN)
    it.loses_lease("b")
    assert it.runs() == []
    it.loses_lease("a")
    assert it.runs() == ["safety.lease_lost"]
    assert it.watch.mover is None
    assert it.begins(BOB) is None
    it.watch.make_safe("safety.timeout")
    it.runs()
    it.loses_lease("b")
    assert it.runs() == ["safety.lease_lost"]


# -- letting go after a stop


def test_after_a_stop_everybody_who_was_there_must_let_go_first(it: Scene) -> None:
    assert not it.watch.must_release(it.command(ANN))
    it.stop()
    assert it.runs() == ["safety.stop"]
    assert it.watch.must_release(it.command(ANN))
    assert it.watch.must_release(it.command(BOB))
    assert it.begins(ANN) is None
    it.watch.finish(accepted=True)
    assert it.watch.must_release(it.command(ANN)), "it was asked elsewhere whether this one may act"
    assert it.begins(ANN, wants_motion=False) is None
    assert not it.watch.must_release(it.command(ANN))
    assert it.watch.must_release(it.command(BOB))


def test_when_its_device_goes_or_is_back_everybody_must_let_go_first(it: Scene) -> None:
    it.watch.begin(it.command(BOB))
    it.watch.peer_left(BOB)
    it.watch.device_changed()
    assert it.watch.must_release(it.command(ANN))
    assert it.watch.must_release(it.command(BOB)), "it commanded last"
    it.watch.begin(it.command(ANN), wants_motion=False)
    assert not it.watch.must_release(it.command(ANN))
    it.watch.device_changed()
    assert it.watch.must_release(it.command(ANN))


def test_who_commanded_and_left_before_the_stop_must_let_go_when_it_comes_back(it: Scene) -> None:
    it.moves(ANN)
    it.watch.peer_left(ANN)
    it.stop()
    it.openings["a2"] = it.watch.peer_joined("a2", "session-a")
    assert it.watch.must_release(it.command(Sender("a2", "session-a")))


def test_who_only_watched_and_left_before_the_stop_has_nothing_to_let_go(it: Scene) -> None:
    it.watch.peer_left(BOB)
    it.stop()
    it.openings["b"] = it.watch.peer_joined("b", "session-b")
    assert not it.watch.must_release(it.command(BOB))


def test_a_pause_lets_go_unless_it_was_before_the_stop(it: Scene) -> None:
    before = it.command(ANN)
    it.stop()
    it.watch.paused(before)
    assert it.watch.must_release(it.command(ANN))
    it.watch.paused(it.command(ANN))
    assert not it.watch.must_release(it.command(ANN))


@pytest.mark.parametrize(
    ("is_motion", "is_stopped", "must"), [(True, True, True), (True, False, False), (False, True, False)]
)
def test_who_comes_while_it_is_stopped_must_let_go_first_of_what_moves(
    made: Make, is_motion: bool, is_stopped: bool, must: bool
) -> None:
    it = made(DRIVE if is_motion else ReceiverSafety())
    it.fence.is_stopped = is_stopped
    it.openings["c"] = it.watch.peer_joined("c")
    assert it.watch.must_release(it.command(Sender("c", ""))) is must


# -- safe actions that fail


def test_a_safe_action_that_fails_is_repeated_after_longer_and_longer_waits_until_it_works(it: Scene) -> None:
    it.fails = True
    it.watch.make_safe("safety.stop")
    assert it.watch.is_unsettled
    for wait_s in (0.05, 0.1, 0.2, 0.5, 1.0, 1.0, 1.0):
        assert it.runs() == ["safety.stop"]
        assert it.watch.is_unsettled
        assert it.watch.due_at_s == pytest.approx(it.now_s + wait_s)
        it.now_s += wait_s - 0.01
        it.expire()
        assert it.runs() == []
        it.now_s += 0.01
        it.expire()
    assert ("safe", it.watch) not in it.fence.heard
    it.fails = False
    assert it.runs() == ["safety.stop"]
    assert not it.watch.is_unsettled
    assert it.watch.due_at_s is None
    assert it.fence.heard == [("safe", it.watch)]
    it.fails = True
    it.watch.make_safe("safety.stop")
    it.runs()
    assert it.watch.due_at_s == pytest.approx(it.now_s + 0.05), "it begins anew"


def test_a_command_that_acts_ends_the_repetition(it: Scene) -> None:
    it.fails = True
    it.watch.make_safe("safety.timeout")
    it.runs()
    assert it.begins() is None
    it.watch.finish(accepted=False)
    assert it.watch.is_unsettled, "one that was refused does not"
    it.moves()
    assert not it.watch.is_unsettled


def test_a_stop_is_told_safe_by_the_last_action_that_waits(it: Scene) -> None:
    it.watch.make_safe("safety.timeout")
    it.stop()
    it.watch.actions.popleft()()
    assert it.fence.heard == []
    it.watch.actions.popleft()()
    assert it.fence.heard == [("safe", it.watch)]


@pytest.mark.parametrize("unsettled", ["acting", "queued", "failed"])
def test_a_watch_is_unsettled_while_a_safe_action_runs_waits_or_has_failed(it: Scene, unsettled: str) -> None:
    assert not it.watch.is_unsettled
    if unsettled == "acting":
        it.watch.is_acting = True
    else:
        it.fails = unsettled == "failed"
        it.watch.make_safe("safety.stop")
        if unsettled == "failed":
            it.runs()
    assert it.watch.is_unsettled


def test_the_first_of_all_deadlines_is_due(it: Scene) -> None:
    it.fails = True
    it.watch.make_safe("safety.timeout")
    it.runs()
    assert it.begins() is None
    assert it.watch.due_at_s == pytest.approx(100.05), "the repetition, before the time-out"
    it.now_s += 0.48
    assert it.watch.due_at_s == pytest.approx(100.05)


# -- zeros


def zeroing(made: Make) -> Scene:
    """Its sender fell silent, and the safe action of the policy ``zero`` has run."""
    it = made(ReceiverSafety(timeout_s=0.5, on_timeout="zero", on_loss="zero"))
    it.moves()
    it.now_s += 0.5
    it.expire()
    assert it.watch.zeros_until_s is None, "not before the safe action"
    assert it.runs() == ["safety.timeout"]
    return it


def test_zeros_follow_the_safe_action_for_a_second(made: Make) -> None:
    it = zeroing(made)
    assert it.woken == 1
    assert it.watch.zeros_until_s == it.now_s + ZEROS_FOR_S
    it.now_s += ZEROS_FOR_S - 0.01
    assert it.watch.begin_zero()
    assert it.watch.finish(accepted=True) is None
    it.now_s += 0.01
    assert it.watch.zeros_until_s is None
    assert not it.watch.begin_zero()


def test_zeros_end_with_the_next_command_with_any_safe_action_and_where_none_can_be_made(made: Make) -> None:
    it = zeroing(made)
    it.moves()
    assert it.watch.zeros_until_s is None
    it = zeroing(made)
    it.watch.make_safe("safety.stop")
    it.runs()
    assert it.watch.zeros_until_s is None
    assert it.woken == 1
    it = zeroing(made)
    it.watch.no_zeros()
    assert it.watch.zeros_until_s is None


def test_a_safe_action_that_a_newer_one_overtook_is_followed_by_no_zeros(made: Make) -> None:
    it = made(ReceiverSafety(timeout_s=0.5, on_timeout="zero"))
    it.moves()
    it.now_s += 0.5
    it.expire()
    it.watch.make_safe("safety.stop")
    assert it.runs() == ["safety.timeout", "safety.stop"]
    assert it.watch.zeros_until_s is None
    assert it.woken == 0


def test_a_stop_overtakes_zeros_too_and_a_refused_zero_gives_nothing_back(made: Make) -> None:
    it = zeroing(made)
    assert it.watch.begin_zero()
    it.watch.make_safe("safety.stop")
    assert it.watch.finish(accepted=False) == "safety.stop"
    assert it.runs() == ["safety.stop", "safety.stop"]
    it = zeroing(made)
    assert it.watch.begin_zero()
    assert it.watch.finish(accepted=False) is None
    assert (it.watch.due_at_s, it.watch.mover) == (None, None)


def test_a_safe_action_that_failed_is_followed_by_its_zeros_when_it_works(made: Make) -> None:
    it = made(ReceiverSafety(timeout_s=0.5, on_timeout="zero"))
    it.moves()
    it.now_s += 0.5
    it.fails = True
    it.expire()
    it.runs()
    assert it.woken == 0
    it.fails = False
    it.now_s += 0.05
    it.expire()
    assert it.runs() == ["safety.timeout"]
    assert it.watch.zeros_until_s == it.now_s + ZEROS_FOR_S


def test_whoever_leaves_is_followed_by_zeros_where_the_policy_says_so(made: Make) -> None:
    it = made(ReceiverSafety(timeout_s=0.5, on_timeout="hold", on_loss="zero"))
    it.moves()
    it.watch.peer_left(ANN)
    assert it.runs() == ["safety.peer_left"]
    assert it.woken == 1
