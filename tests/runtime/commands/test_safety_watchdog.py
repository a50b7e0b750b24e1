"""Safe actions are on time, whatever else hangs."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator

import pytest

from mosaic_core import Sender
from mosaic_core.runtime.commands.inbox import Incoming
from mosaic_core.runtime.commands.safety_watch import MAX_FAREWELLS, SafetyWatch
from mosaic_core.runtime.commands.safety_watchdog import SafetyWatchdog
from mosaic_core.runtime.configuration.receiver_safety import ReceiverSafety

ANN = Sender("ann", "s")
PATIENCE_S = 2.0
TOLERANCE_S = 0.02
"""The promise: ``timeout_s`` + 20 ms."""


class SafeActions:
    """``calls``: (cause, when); ``slow_s``: how long its safe action takes."""

    def __init__(self, slow_s: float = 0.0) -> None:
        self.calls: list[tuple[str, float]] = []
        self.called = threading.Semaphore(0)
        self.slow_s = slow_s
        self.release = threading.Event()

    def make_safe(self, cause: str) -> None:
        self.calls.append((cause, time.monotonic()))
        self.called.release()
        if self.slow_s:
            self.release.wait(self.slow_s)

    def peer_left(self, sender: Sender) -> None:
        self.calls.append((f"left {sender.peer_id}", time.monotonic()))
        self.called.release()

    def causes(self) -> list[str]:
        return [cause for cause, _ in self.calls]


@pytest.fixture
def safety() -> Iterator[SafetyWatchdog]:
    it = SafetyWatchdog()
    it.start()
    yield it
    it.close()


def begins(watch: SafetyWatch, peer_id: str = "ann") -> bool:
    """A command of this peer, on the channel that it opened last, is about to act."""
    opening = watch._openings.get(peer_id, 0)
    item = Incoming("drive", b"", Sender(peer_id, "s"), 1, 0.0, opening=opening, generation=watch.generation)
    return watch.begin(item) is None


def guarded(safety: SafetyWatchdog, motor: SafeActions, timeout_s: float | None = 0.1) -> SafetyWatch:
    watch = safety.guard("drive", ReceiverSafety(timeout_s=timeout_s), motor.make_safe, motor.peer_left)
    watch.peer_joined("ann")
    return watch


def test_it_fires_in_time_and_once(safety: SafetyWatchdog) -> None:
    motor = SafeActions()
    watch = guarded(safety, motor)
    late_s = []
    for _ in range(5):
        assert begins(watch)
        fed_s = time.monotonic()
        watch.finish(accepted=True)
        assert motor.called.acquire(timeout=PATIENCE_S)
        late_s.append(motor.calls[-1][1] - fed_s - 0.1)
    assert sorted(late_s)[2] < TOLERANCE_S
    assert not motor.called.acquire(timeout=0.2)
    assert motor.causes() == ["safety.timeout"] * 5


def test_commands_keep_it_quiet(safety: SafetyWatchdog) -> None:
    motor = SafeActions()
    watch = guarded(safety, motor)
    for _ in range(20):
        begins(watch)
        watch.finish(accepted=True)
        assert not motor.called.acquire(timeout=0.02)


def test_a_hanging_handler_is_made_safe_in_time_and_again_when_it_returns(safety: SafetyWatchdog) -> None:
    motor = SafeActions()
    watch = guarded(safety, motor)
    begins(watch)
    assert motor.called.acquire(timeout=PATIENCE_S), "while handle_data still runs"
    watch.finish(accepted=True)
    assert motor.called.acquire(timeout=PATIENCE_S), "it may have set the motor after the safe action"
    assert motor.causes() == ["safety.timeout", "safety.timeout"]


def test_a_slow_safe_action_of_one_receiver_does_not_delay_the_others(safety: SafetyWatchdog) -> None:
    slow = [SafeActions(slow_s=PATIENCE_S) for _ in range(3)]
    quick = SafeActions()
    watches = [guarded(safety, motor, 0.05) for motor in slow] + [guarded(safety, quick, 0.1)]
    for watch in watches:
        begins(watch)
        watch.finish(accepted=True)
    fed_s = time.monotonic()
    assert quick.called.acquire(timeout=PATIENCE_S)
    assert quick.calls[0][1] - fed_s < PATIENCE_S / 2
    for motor in slow:
        motor.release.set()


def test_an_error_in_a_safe_action_is_logged_and_the_thread_lives(
    safety: SafetyWatchdog, caplog: pytest.LogCaptureFixture
) -> None:
    def broken(_cause: str) -> None:
        raise RuntimeError("valve stuck")

    bad = safety.guard("valve", ReceiverSafety(timeout_s=0.02), broken, lambda _: None)
    bad.peer_joined("ann")
    begins(bad)
    bad.finish(accepted=True)
    motor = SafeActions()
    watch = guarded(safety, motor)
    begins(watch)
    watch.finish(accepted=True)
    assert motor.called.acquire(timeout=PATIENCE_S)
    assert "valve stuck" in caplog.text


class Stuck(SafeActions):
    """Its safe action fails until ``works``."""

    def __init__(self) -> None:
        super().__init__()
        self.works = threading.Event()

    def make_safe(self, cause: str) -> None:
        super().make_safe(cause)
        if not self.works.is_set():
            raise OSError("write timed out")


def test_a_safe_action_that_failed_is_repeated_until_it_works(safety: SafetyWatchdog) -> None:
    motor = Stuck()
    watch = guarded(safety, motor, None)
    begins(watch)
    watch.finish(accepted=True)
    watch.peer_left(ANN)
    for _ in range(3):
        assert motor.called.acquire(timeout=PATIENCE_S)
    motor.works.set()
    while motor.called.acquire(timeout=0.6):
        pass
    assert set(motor.causes()) == {"safety.peer_left", "left ann"}
    assert watch.due_at_s is None, "nothing is repeated any more"


def test_at_the_end_too_a_failed_safe_action_is_repeated(safety: SafetyWatchdog) -> None:
    class SecondTime(SafeActions):
        def make_safe(self, cause: str) -> None:
            super().make_safe(cause)
            if len(self.calls) == 1:
                raise OSError("write timed out")

    motor = SecondTime()
    guarded(safety, motor)
    assert safety.make_all_safe("safety.shutdown", PATIENCE_S)
    assert motor.causes() == ["safety.shutdown"] * 2
    never = Stuck()
    guarded(safety, never)
    assert not safety.make_all_safe("safety.shutdown", 0.05)


def test_a_newer_command_ends_the_repetition(safety: SafetyWatchdog) -> None:
    motor = Stuck()
    watch = guarded(safety, motor, None)
    watch.make_safe("safety.shutdown")
    for _ in range(4):  # the next repetition is half a second away
        assert motor.called.acquire(timeout=PATIENCE_S)
    with safety.changed:
        assert safety.changed.wait_for(lambda: watch.due_at_s is not None, PATIENCE_S)
    begins(watch)
    watch.finish(accepted=False)
    assert watch.due_at_s is not None, "a refused command ends nothing"
    begins(watch)
    watch.finish(accepted=True)
    assert watch.due_at_s is None


def test_a_safe_action_that_exits_leaves_the_threads_to_the_others(safety: SafetyWatchdog) -> None:
    def exits(_cause: str) -> None:
        raise SystemExit(1)

    for _ in range(3):  # more often than there are threads to spare
        bad = safety.guard("valve", ReceiverSafety(), exits, lambda _: None)
        bad.make_safe("safety.shutdown")
    motor = SafeActions()
    watch = guarded(safety, motor)
    begins(watch)
    watch.finish(accepted=True)
    assert motor.called.acquire(timeout=PATIENCE_S)


def test_an_endless_time_out_of_one_receiver_leaves_the_others_guarded(safety: SafetyWatchdog) -> None:
    endless = guarded(safety, SafeActions(), float("inf"))
    begins(endless)
    endless.finish(accepted=True)
    endless.peer_left(Sender("bob", "s"))  # every safety thread looks at the deadlines
    motor = SafeActions()
    watch = guarded(safety, motor)
    begins(watch)
    watch.finish(accepted=True)
    assert motor.called.acquire(timeout=PATIENCE_S)


def test_a_commander_who_left_while_another_ones_command_was_refused_is_stopped(safety: SafetyWatchdog) -> None:
    motor = SafeActions()
    watch = guarded(safety, motor, None)
    watch.peer_joined("bob")
    begins(watch)
    watch.finish(accepted=True)
    begins(watch, "bob")
    watch.peer_left(ANN)
    assert motor.called.acquire(timeout=PATIENCE_S)
    watch.finish(accepted=False)
    assert motor.called.acquire(timeout=PATIENCE_S)
    assert motor.causes() == ["left ann", "safety.peer_left"]


def test_the_commander_leaving_stops_at_once_and_its_late_commands_do_not_act(safety: SafetyWatchdog) -> None:
    motor = SafeActions()
    watch = guarded(safety, motor, 5.0)
    begins(watch)
    watch.finish(accepted=True)
    watch.peer_left(ANN)
    for _ in range(2):
        assert motor.called.acquire(timeout=PATIENCE_S)
    assert motor.causes() == ["safety.peer_left", "left ann"]
    assert not begins(watch)
    watch.peer_joined("ann")
    assert begins(watch)


def test_a_refused_command_does_not_prolong_motion(safety: SafetyWatchdog) -> None:
    motor = SafeActions()
    watch = guarded(safety, motor, 0.15)
    begins(watch)
    watch.finish(accepted=True)
    fed_s = time.monotonic()
    while not motor.called.acquire(timeout=0.01):
        begins(watch)
        watch.finish(accepted=False)
        assert time.monotonic() - fed_s < PATIENCE_S
    assert motor.calls[0][1] - fed_s < 0.15 + 3 * TOLERANCE_S


def test_everything_is_made_safe_at_the_end(safety: SafetyWatchdog) -> None:
    motors = [SafeActions(), SafeActions()]
    for motor in motors:
        guarded(safety, motor)
    assert safety.make_all_safe("safety.shutdown", PATIENCE_S)
    assert [motor.causes() for motor in motors] == [["safety.shutdown"]] * 2


def test_an_action_that_hangs_at_the_end_is_told(safety: SafetyWatchdog) -> None:
    motor = SafeActions(slow_s=PATIENCE_S)
    guarded(safety, motor)
    assert not safety.make_all_safe("safety.shutdown", 0.05)
    motor.release.set()


def test_a_busy_processor_does_not_delay_it(safety: SafetyWatchdog) -> None:
    stop = threading.Event()

    def burn() -> None:
        while not stop.is_set():
            sum(range(1000))

    burners = [threading.Thread(target=burn) for _ in range(3)]
    for burner in burners:
        burner.start()
    motor = SafeActions()
    watch = guarded(safety, motor)
    late_s = []
    for _ in range(7):
        begins(watch)
        fed_s = time.monotonic()
        watch.finish(accepted=True)
        assert motor.called.acquire(timeout=PATIENCE_S)
        late_s.append(motor.calls[-1][1] - fed_s - 0.1)
    stop.set()
    for burner in burners:
        burner.join()
    assert sorted(late_s)[3] < 0.06, "three burning threads may each keep the interpreter for 5 ms"


def test_farewells_behind_a_peer_left_that_hangs_are_bounded_and_the_safe_action_still_runs(
    safety: SafetyWatchdog,
) -> None:
    release, motor = threading.Event(), SafeActions()
    watch = safety.guard("drive", ReceiverSafety(), motor.make_safe, lambda _: release.wait(PATIENCE_S) and None)
    for _ in range(2 * MAX_FAREWELLS):
        watch.peer_joined("ann")
        watch.peer_left(ANN)
    assert len(watch.farewells) <= MAX_FAREWELLS
    watch.make_safe("safety.stop")
    assert motor.called.acquire(timeout=PATIENCE_S)
    release.set()
