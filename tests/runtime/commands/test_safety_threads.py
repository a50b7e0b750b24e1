"""Who waits, who acts and who takes over among the safety threads, turn by turn on a clock that the test moves."""

from __future__ import annotations

import logging
from collections.abc import Callable
from types import SimpleNamespace

import pytest

from mosaic_core import Sender
from mosaic_core.runtime.commands import safety_watch, safety_watchdog
from mosaic_core.runtime.commands.inbox import Incoming
from mosaic_core.runtime.commands.safety_watch import SafetyWatch
from mosaic_core.runtime.commands.safety_watchdog import SafetyWatchdog
from mosaic_core.runtime.configuration.receiver_safety import ReceiverSafety
from mosaic_core.words.errors import DeviceGone

ANN = Sender("ann", "s")
HOUR_S = 3600.0


class Parked(BaseException):
    """A thread waits: its turn is over."""


class Stage:
    """Stands in for threads, their lock and the clock. A thread runs while it has its turn; whatever an action calls
    meanwhile happens beside it."""

    def __init__(self) -> None:
        self.now_s = 1000.0
        self.threads: list[SimpleNamespace] = []
        self.waits_s: list[float] = []
        self.patience_s: list[float] = []
        self.is_done: Callable[[], bool] | None = None
        """What somebody waits for: as soon as it is true at a notice, nobody waits any more."""
        self.depth = self.notices = self.firsts = 0

    def monotonic(self) -> float:
        return self.now_s

    # -- the module ``threading``

    def Condition(self) -> Stage:
        return self

    def Thread(self, target: Callable[[], None], name: str, daemon: bool) -> SimpleNamespace:
        thread = SimpleNamespace(run=target, name=name, daemon=daemon, is_started=False)
        thread.start = lambda: self.threads.append(thread)
        return thread

    # -- the condition

    def acquire(self) -> None:
        self.depth += 1

    def release(self) -> None:
        assert self.depth == 1, "only the lock that one holds once is free after a release"
        self.depth -= 1

    def __enter__(self) -> None:
        self.depth += 1

    def __exit__(self, *_: object) -> None:
        self.depth -= 1

    def wait(self, timeout_s: float) -> None:
        assert self.depth == 1
        self.waits_s.append(timeout_s)
        raise Parked

    def wait_for(self, predicate: Callable[[], bool], timeout_s: float) -> bool:
        assert self.depth == 1
        self.patience_s.append(timeout_s)
        self.is_done = predicate
        self.depth = 0
        while not predicate() and self.turn():
            pass
        self.depth = 1
        return predicate()

    def notify_all(self) -> None:
        assert self.depth > 0
        self.notices += 1
        if self.is_done is not None and self.is_done():
            self.is_done = None

    # -- the test

    def turn(self, of: int = -1) -> bool:
        """Let one thread run until it waits or ends; whether it did anything but wait."""
        notices, depth, self.depth = self.notices, self.depth, 0
        thread = self.threads[of]
        try:
            thread.run()
            self.threads.remove(thread)
        except Parked:
            pass
        finally:
            self.depth = depth
        return self.notices > notices


@pytest.fixture
def stage(monkeypatch: pytest.MonkeyPatch) -> Stage:
    it = Stage()

    def run_first() -> None:
        it.firsts += 1

    monkeypatch.setattr(safety_watchdog, "threading", it)
    monkeypatch.setattr(safety_watchdog, "time", it)
    monkeypatch.setattr(safety_watchdog, "run_first", run_first)
    monkeypatch.setattr(safety_watch, "time", it)
    return it


@pytest.fixture
def safety(stage: Stage) -> SafetyWatchdog:
    it = SafetyWatchdog()
    it.start()
    return it


class Motor:
    """``calls``: what it was told; ``meanwhile``: what happens while a safe action or a farewell runs."""

    def __init__(self, stage: Stage) -> None:
        self.calls: list[str] = []
        self.meanwhile: list[Callable[[], object]] = []
        self._stage = stage

    def make_safe(self, cause: str) -> None:
        self._called(cause)

    def peer_left(self, sender: Sender) -> None:
        self._called(f"left {sender.peer_id}")

    def _called(self, what: str) -> None:
        assert self._stage.depth == 0, "nobody holds the lock while a plugin acts"
        self.calls.append(what)
        if self.meanwhile:
            self.meanwhile.pop(0)()


def guarded(safety: SafetyWatchdog, motor: Motor, label: str = "drive", timeout_s: float | None = None) -> SafetyWatch:
    return safety.guard(label, ReceiverSafety(timeout_s=timeout_s), motor.make_safe, motor.peer_left)


def commanded(watch: SafetyWatch) -> None:
    item = Incoming(watch.label, b"", ANN, 1, 0.0, opening=watch.peer_joined("ann"), generation=watch.generation)
    assert watch.begin(item) is None
    watch.finish(accepted=True)


class Fence:
    """``expired``: when it was asked."""

    def __init__(self, due_at_s: float | None = None) -> None:
        self.due_at_s = due_at_s
        self.expired: list[float] = []

    def refusal(self, *_: object) -> None:
        return None

    def commanded(self, *_: object) -> None: ...
    def made_safe(self, *_: object) -> None: ...

    def expire(self, now_s: float) -> None:
        self.expired.append(now_s)


# -- the threads


def test_two_threads_stand_ready_and_run_before_others(stage: Stage, safety: SafetyWatchdog) -> None:
    assert [(one.name, one.daemon) for one in stage.threads] == [("mosaic-safety-1", True), ("mosaic-safety-2", True)]
    stage.turn(0)
    stage.turn(1)
    assert stage.firsts == 2


def test_the_last_ready_thread_puts_another_one_in_its_place_before_it_acts(
    stage: Stage, safety: SafetyWatchdog
) -> None:
    slow, slower = Motor(stage), Motor(stage)
    guarded(safety, slow).make_safe("one")
    guarded(safety, slower).make_safe("another")
    names: list[list[str]] = []

    def note() -> None:
        names.append([one.name for one in stage.threads])

    slow.meanwhile = [lambda: (note(), stage.turn(1))]
    slower.meanwhile = [note]
    stage.turn(0)
    assert names == [["mosaic-safety-1", "mosaic-safety-2"], [f"mosaic-safety-{number}" for number in (1, 2, 3)]]
    assert [one.name for one in stage.threads] == ["mosaic-safety-2", "mosaic-safety-3"], "two are enough again"


def test_whoever_is_too_many_goes_and_the_next_shortage_is_filled_again(stage: Stage, safety: SafetyWatchdog) -> None:
    newest: list[str] = []
    for _ in range(3):
        first, second = Motor(stage), Motor(stage)
        guarded(safety, first).make_safe("one")
        guarded(safety, second).make_safe("another")
        first.meanwhile = [lambda: stage.turn(1)]
        second.meanwhile = [lambda: newest.append(stage.threads[-1].name)]
        stage.turn(0)
        assert len(stage.threads) == 2
    assert newest == ["mosaic-safety-3", "mosaic-safety-4", "mosaic-safety-5"]


def test_a_broken_safe_action_costs_no_thread_and_is_told_with_its_label(
    stage: Stage, safety: SafetyWatchdog, caplog: pytest.LogCaptureFixture
) -> None:
    def exits(_cause: str) -> None:
        raise SystemExit("valve stuck")

    valve = safety.guard("valve", ReceiverSafety(), exits, lambda _: None)
    with caplog.at_level(logging.ERROR):
        valve.make_safe("safety.stop")
        stage.turn()
    assert not valve.is_acting
    assert len(stage.threads) == 2
    [record] = caplog.records
    assert record.name == "mosaic_core.runtime.commands.safety_watchdog"
    assert "'valve'" in record.getMessage()
    assert vars(record)["label"] == "valve"
    assert record.exc_info is not None
    assert str(record.exc_info[1]) == "valve stuck"


def test_a_safe_action_that_breaks_again_and_again_has_one_traceback_is_counted_and_told_when_it_works(
    stage: Stage, safety: SafetyWatchdog, caplog: pytest.LogCaptureFixture
) -> None:
    def breaks(_cause: str) -> None:
        if valve.failures < 12:
            raise OSError("valve stuck")

    valve = safety.guard("valve", ReceiverSafety(), breaks, lambda _: None)
    for _ in range(13):
        valve.make_safe("safety.stop")
        stage.turn()
    told = [(record.getMessage(), record.exc_info is not None) for record in caplog.records]
    assert {vars(record)["label"] for record in caplog.records} == {"valve"}
    assert told == [
        ("the safe action of 'valve' failed", True),
        ("the safe action of 'valve' has failed 10 times", False),
        ("the safe action of 'valve' works again; it had failed 12 times", False),
    ]


def test_a_safe_action_that_waits_for_its_device_is_told_once_and_quietly(
    stage: Stage, safety: SafetyWatchdog, caplog: pytest.LogCaptureFixture
) -> None:
    def waits(_cause: str) -> None:
        raise DeviceGone("no valve")

    valve = safety.guard("valve", ReceiverSafety(), waits, lambda _: None)
    with caplog.at_level(logging.INFO):
        for _ in range(10):
            valve.make_safe("safety.stop")
            stage.turn()
            told = [(record.levelname, record.getMessage(), record.exc_info) for record in caplog.records]
            assert told == [("WARNING", "the safe action of 'valve' waits for its device: no valve", None)]
    assert vars(caplog.records[0])["label"] == "valve"


def test_neither_what_never_failed_nor_a_farewell_works_again(
    stage: Stage, safety: SafetyWatchdog, caplog: pytest.LogCaptureFixture
) -> None:
    sound = safety.guard("sound", ReceiverSafety(), lambda _: None, lambda _: None)
    sound.make_safe("safety.stop")
    stage.turn()
    sound.failures = 3
    sound.peer_joined("ann")
    sound.peer_left(Sender("ann", "session"))
    stage.turn()
    assert caplog.records == []


def test_a_farewell_that_breaks_is_no_safe_action(
    stage: Stage, safety: SafetyWatchdog, caplog: pytest.LogCaptureFixture
) -> None:
    def forgets(_sender: Sender) -> None:
        raise KeyError("ann")

    valve = safety.guard("valve", ReceiverSafety(), lambda _: None, forgets)
    valve.peer_joined("ann")
    valve.peer_left(Sender("ann", "session"))
    stage.turn()
    [record] = caplog.records
    assert (record.getMessage(), vars(record)["label"]) == ("peer_left of 'valve' failed", "valve")


def test_who_waits_for_an_action_hears_of_its_beginning_and_of_its_end(stage: Stage, safety: SafetyWatchdog) -> None:
    motor, told = Motor(stage), []
    guarded(safety, motor).make_safe("safety.stop")
    before = stage.notices
    motor.meanwhile = [lambda: told.append(stage.notices - before)]
    stage.turn()
    assert (told, stage.notices - before) == ([1], 2)


# -- waiting


def test_with_nothing_due_a_thread_looks_again_in_an_hour(stage: Stage, safety: SafetyWatchdog) -> None:
    guarded(safety, Motor(stage))
    stage.turn()
    assert stage.waits_s == [HOUR_S]


def test_a_thread_waits_for_the_first_deadline_of_all(stage: Stage, safety: SafetyWatchdog) -> None:
    quick, motor = Motor(stage), Motor(stage)
    commanded(guarded(safety, motor, timeout_s=0.5))
    commanded(guarded(safety, quick, timeout_s=0.25))
    stage.now_s += 0.125
    stage.turn()
    assert stage.waits_s == [0.125]
    stage.now_s += 0.125
    stage.turn()
    assert (quick.calls, motor.calls) == (["safety.timeout"], [])
    assert stage.waits_s == [0.125, 0.25]


def test_a_deadline_that_passes_just_before_the_waiting_is_looked_at_without_any(
    stage: Stage, safety: SafetyWatchdog
) -> None:
    safety.fence = Fence(due_at_s=stage.now_s - 5.0)
    stage.turn()
    assert stage.waits_s == [0.0]


def test_the_deadline_of_the_fence_counts_too(stage: Stage, safety: SafetyWatchdog) -> None:
    fence = safety.fence = Fence()
    stage.turn()
    fence.due_at_s = stage.now_s + 2.0
    stage.turn()
    assert stage.waits_s == [HOUR_S, 2.0]
    assert fence.expired == [1000.0, 1000.0]


@pytest.mark.parametrize(("due_s", "is_woken"), [(0.25, True), (0.5, False), (0.75, False), (None, False)])
def test_only_a_deadline_before_the_planned_one_wakes_a_thread(
    stage: Stage, safety: SafetyWatchdog, due_s: float | None, is_woken: bool
) -> None:
    commanded(guarded(safety, Motor(stage), timeout_s=0.5))
    stage.turn()
    before = stage.notices
    with safety.changed:
        safety.deadline_moved(None if due_s is None else stage.now_s + due_s)
    assert stage.notices - before == is_woken


def test_the_first_deadline_wakes_whoever_waits_without_one(stage: Stage, safety: SafetyWatchdog) -> None:
    with safety.changed:
        safety.deadline_moved(stage.now_s + HOUR_S)
    assert stage.notices == 1


# -- what comes first


def test_safe_actions_of_all_receivers_come_before_any_farewell(stage: Stage, safety: SafetyWatchdog) -> None:
    motor, calls = Motor(stage), []
    for label in ("first", "second"):
        watch = guarded(safety, motor, label)
        commanded(watch)
        watch.peer_left(ANN)
    motor.meanwhile = [lambda: calls.append(list(motor.calls))] * 4
    stage.turn()
    assert motor.calls == ["safety.peer_left", "safety.peer_left", "left ann", "left ann"]


def test_a_safe_action_is_not_run_beside_itself(stage: Stage, safety: SafetyWatchdog) -> None:
    motor, other = Motor(stage), Motor(stage)
    watch = guarded(safety, motor)
    watch.make_safe("one")
    watch.make_safe("two")
    guarded(safety, other).make_safe("three")
    motor.meanwhile = [lambda: stage.turn(1) and motor.calls.append("returned")]
    stage.turn(0)
    stage.turn()
    assert motor.calls == ["one", "returned", "two"]
    assert other.calls == ["three"], "what another receiver has to do is done meanwhile"


def test_a_farewell_waits_for_its_receivers_safe_action_and_for_the_one_before(
    stage: Stage, safety: SafetyWatchdog
) -> None:
    motor = Motor(stage)
    watch = guarded(safety, motor)
    commanded(watch)
    watch.peer_left(ANN)
    watch.peer_left(Sender("bob", "s"))
    motor.meanwhile = [lambda: (stage.turn(1), motor.calls.append("returned"))] * 2
    stage.turn(0)
    assert motor.calls == ["safety.peer_left", "returned", "left ann", "returned", "left bob"]
    assert not watch.is_parting


def test_a_safe_action_does_not_wait_for_a_farewell(stage: Stage, safety: SafetyWatchdog) -> None:
    motor = Motor(stage)
    watch = guarded(safety, motor)
    watch.peer_left(ANN)
    motor.meanwhile = [
        lambda: (watch.make_safe("safety.stop"), stage.turn(1), motor.calls.append("returned")),
    ]
    stage.turn(0)
    assert motor.calls == ["left ann", "safety.stop", "returned"]


def test_the_fence_is_asked_before_the_watches(stage: Stage, safety: SafetyWatchdog) -> None:
    motor = Motor(stage)
    watch = guarded(safety, motor)

    class Ending(Fence):
        def expire(self, now_s: float) -> None:
            super().expire(now_s)
            if len(self.expired) == 1:
                watch.stop()

    safety.fence = Ending()
    stage.turn()
    assert motor.calls == ["safety.stop"], "in the very turn in which the fence asked for it"


# -- the end


def test_making_all_safe_waits_as_long_as_it_may(stage: Stage, safety: SafetyWatchdog) -> None:
    motors = [Motor(stage), Motor(stage)]
    for motor in motors:
        guarded(safety, motor)
    assert safety.make_all_safe("safety.shutdown", 0.4)
    assert stage.patience_s == [0.4]
    assert [motor.calls for motor in motors] == [["safety.shutdown"]] * 2


@pytest.mark.parametrize("stuck", [0, 1])
def test_one_safe_action_that_failed_makes_it_unsafe(stage: Stage, safety: SafetyWatchdog, stuck: int) -> None:
    motors = [Motor(stage), Motor(stage)]
    for motor in motors:
        guarded(safety, motor)
    motors[stuck].meanwhile = [lambda: 1 / 0]
    assert not safety.make_all_safe("safety.shutdown", 0.4)


def test_a_receiver_that_is_gone_is_watched_no_more_and_the_others_are(stage: Stage, safety: SafetyWatchdog) -> None:
    gone, left = Motor(stage), Motor(stage)
    unloaded = guarded(safety, gone, timeout_s=0.25)
    commanded(unloaded)
    commanded(guarded(safety, left, timeout_s=0.5))
    safety.forget([unloaded])
    stage.turn()
    assert stage.waits_s == [0.5]
    assert safety.make_all_safe("safety.shutdown", 0.4)
    assert (gone.calls, left.calls) == ([], ["safety.shutdown"])


def test_at_the_end_farewells_are_waited_for(stage: Stage, safety: SafetyWatchdog) -> None:
    motor, are_waited_for = Motor(stage), []
    guarded(safety, motor).peer_left(ANN)
    motor.meanwhile = [lambda: are_waited_for.append(stage.is_done is not None)] * 2
    assert safety.make_all_safe("safety.shutdown", 0.4)
    assert (motor.calls, are_waited_for) == (["safety.shutdown", "left ann"], [True, True])
    assert stage.is_done is None


def test_one_farewell_that_still_runs_is_waited_for_but_is_no_danger(stage: Stage, safety: SafetyWatchdog) -> None:
    motor, is_safe = Motor(stage), []
    guarded(safety, Motor(stage))
    guarded(safety, motor).peer_left(ANN)
    motor.meanwhile = [lambda: is_safe.append((safety.make_all_safe("safety.shutdown", 0.4), stage.is_done))]
    stage.turn()
    [(was_safe, is_done)] = is_safe
    assert was_safe
    assert is_done is not None, "somebody would still wait"


def test_once_closed_the_threads_end_but_finish_what_is_queued(stage: Stage, safety: SafetyWatchdog) -> None:
    motor = Motor(stage)
    fence = safety.fence = Fence()
    guarded(safety, motor).make_safe("safety.shutdown")
    before = stage.notices
    safety.close()
    assert stage.notices == before + 1
    while stage.threads:
        stage.turn()
    assert motor.calls == ["safety.shutdown"]
    assert stage.waits_s == []
    assert fence.expired == [], "nobody commands any more"
