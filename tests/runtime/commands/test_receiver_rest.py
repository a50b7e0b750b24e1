"""A message that breaks a receiver costs its sender the back-off, longer each time, and nobody else anything."""

from __future__ import annotations

import time
from types import SimpleNamespace
from typing import Any

import pytest

from mosaic_core.contract.handler import DataChannelReceivable
from mosaic_core.contract.host import Sender
from mosaic_core.machines.commands.gates import Gate
from mosaic_core.machines.delivery.send_scheduler import LIMITS, Priority
from mosaic_core.machines.timing.failure_course import ERROR_POLICY
from mosaic_core.runtime.commands.inbox import Incoming
from mosaic_core.runtime.commands.safety_watchdog import SafetyWatchdog
from mosaic_core.runtime.configuration.receiver_safety import ReceiverSafety
from mosaic_core.runtime.handlers import receiver as receiver_module
from mosaic_core.runtime.handlers.receiver import FORGIVEN_S, Outcome, Receiver
from mosaic_core.runtime.threads import failures as failures_module
from mosaic_core.runtime.threads.failures import Failures
from mosaic_core.testing import until
from mosaic_core.words.errors import DeviceGone


class Panic(BaseException):
    """What an extension in Rust raises."""


class Fragile(DataChannelReceivable[dict[str, Any]]):
    async def handle_data(self, data: dict[str, Any]) -> None:
        if data == {"v": 2}:
            raise DeviceGone("motor gone")
        if data == {"v": 3}:
            raise Panic
        if data:
            raise OSError("motor gone")


class Bench:
    """A receiver on a clock that a test moves; delays have no jitter."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.now_s = 1000.0
        monkeypatch.setattr(receiver_module, "time", SimpleNamespace(monotonic=lambda: self.now_s))
        monkeypatch.setattr(failures_module, "random", SimpleNamespace(random=lambda: 0.0))
        self.done: list[Outcome] = []
        self.delays: list[float] = []
        handler, safety = Fragile("it"), SafetyWatchdog()
        watch = safety.guard("it", ReceiverSafety(), handler.make_safe, handler.peer_left)
        failures = Failures("it", lambda label, error, delay_s: self.delays.append(delay_s))
        limits = LIMITS[Priority.RELIABLE]
        self.receiver = Receiver(
            handler, watch, failures, self.done.append, newest_only=False, limits=limits, max_age_s=None
        )
        self.receiver.start()

    async def says(self, peer: str, payload: bytes = b'{"v": 1}') -> Outcome:
        sender, before = Sender(peer, peer), len(self.done)
        opening = self.receiver.channel_opened(sender)
        generation = self.receiver.watch.generation
        self.receiver.accept(Incoming("it", payload, sender, 1, time.monotonic(), 0, opening, generation))
        await until(lambda: len(self.done) > before)
        return self.done[-1]


@pytest.fixture
async def bench(monkeypatch: pytest.MonkeyPatch) -> Any:
    it = Bench(monkeypatch)
    yield it
    it.receiver.close()
    await it.receiver.closed()


async def test_the_senders_rest_grows_with_each_error_right_after_it(bench: Bench) -> None:
    for factor in (1, 2, 4):
        outcome = await bench.says("ann")
        assert outcome.refusal is not None
        assert (outcome.refusal.gate, outcome.refusal.code) == (Gate.HANDLER, "plugin.failed")
        assert bench.delays[-1] == ERROR_POLICY.first_s * factor
        bench.now_s += bench.delays[-1] - 0.01
        assert bench.receiver.is_resting
        resting = await bench.says("ann", b"{}")
        assert resting.refusal is not None
        assert resting.refusal.gate is Gate.REST
        bench.now_s += 0.02
        assert not bench.receiver.is_resting


async def test_whose_command_found_no_device_is_told_so_while_he_rests(bench: Bench) -> None:
    for gate in (Gate.HANDLER, Gate.REST):
        outcome = await bench.says("ann", b'{"v": 2}')
        assert outcome.refusal is not None
        assert (outcome.refusal.gate, outcome.refusal.code) == (gate, "plugin.no_device")


async def test_a_panic_costs_its_sender_a_rest_and_the_receiver_goes_on(bench: Bench) -> None:
    outcome = await bench.says("ann", b'{"v": 3}')
    assert outcome.refusal is not None
    assert outcome.refusal.code == "plugin.failed"
    assert (await bench.says("bob", b"{}")).refusal is None


async def test_whoever_broke_nothing_is_served_meanwhile(bench: Bench) -> None:
    await bench.says("ann")
    assert (await bench.says("bob", b"{}")).refusal is None
    assert bench.receiver.is_resting, "ann rests, whatever bob does"
    resting = await bench.says("ann", b"{}")
    assert resting.refusal is not None
    assert "motor gone" not in resting.refusal.message


async def test_an_error_long_after_the_rest_is_a_first_one_again(bench: Bench) -> None:
    await bench.says("ann")
    bench.now_s += bench.delays[-1] + 0.1
    await bench.says("ann")
    bench.now_s += bench.delays[-1] + ERROR_POLICY.stable_s
    await bench.says("ann")
    assert bench.delays == [0.5, 1.0, 0.5]


async def test_nobody_is_kept_who_was_forgiven(bench: Bench) -> None:
    await bench.says("ann")
    bench.now_s += bench.delays[-1] + FORGIVEN_S - 0.1
    await bench.says("bob")
    assert set(bench.receiver._rests) == {"ann", "bob"}
    bench.now_s += 0.2
    await bench.says("cid")
    assert set(bench.receiver._rests) == {"bob", "cid"}
