"""A safe action overtakes a command, whatever the plugin's receiver does: it knows nothing of stops here."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import AsyncIterator
from typing import Any

import pytest
from pydantic import field_validator

from mosaic_core import DataChannelJsonReceivable, DataChannelReceivable, Message, Sender
from mosaic_core.machines.commands.gates import Gate, GateRefusal
from mosaic_core.machines.control.lease_desk import LeaseDesk
from mosaic_core.machines.control.stop_latch import StopLatch
from mosaic_core.machines.delivery.send_scheduler import LIMITS, Priority
from mosaic_core.runtime.commands.fence import Fence
from mosaic_core.runtime.commands.inbox import Incoming
from mosaic_core.runtime.commands.safety_watchdog import SafetyWatchdog
from mosaic_core.runtime.configuration.receiver_safety import ReceiverSafety
from mosaic_core.runtime.handlers.receiver import Outcome, Receiver
from mosaic_core.runtime.threads.failures import Failures
from mosaic_core.runtime.threads.handler_thread import STOP_PATIENCE_S
from mosaic_core.testing import until

ANN = Sender("ann", "s")


class Slow(DataChannelJsonReceivable):
    """Somebody else's: a device that moves when it feels like it."""

    def __init__(self) -> None:
        super().__init__("slow")
        self.speed = 0.0
        self.made_safe = 0
        self.hangs = threading.Event()
        self.goes_on = threading.Event()
        self.goes_on.set()

    def handle_data(self, data: dict[str, Any]) -> None:
        self.hangs.set()
        assert self.goes_on.wait(20.0)
        self.speed = data["v"]

    def make_safe(self, cause: str) -> None:
        self.made_safe += 1
        self.speed = 0.0


class SlowAsync(Slow):
    async def handle_data(self, data: dict[str, Any]) -> None:  # type: ignore[override]
        self.hangs.set()
        await asyncio.to_thread(self.goes_on.wait, 20.0)
        self.speed = data["v"]


class Scene:
    def __init__(self, handler: DataChannelReceivable[Any]) -> None:
        self.handler: Any = handler
        self.done: list[Outcome] = []
        self.safety = SafetyWatchdog()
        self.latch = StopLatch()
        self.fence = Fence(self.safety, LeaseDesk(()), self.latch, lambda effect: None)
        watch = self.safety.guard("slow", ReceiverSafety(timeout_s=60.0), handler.make_safe, handler.peer_left)
        failures = Failures("slow", lambda *failure: None)
        limits = LIMITS[Priority.RELIABLE]
        self.receiver = Receiver(
            handler, watch, failures, self.done.append, newest_only=False, limits=limits, max_age_s=None
        )
        self.opening = self.receiver.channel_opened(ANN)

    def says(self, payload: bytes) -> None:
        generation = self.receiver.watch.generation
        now_s = time.monotonic()
        self.receiver.accept(Incoming("slow", payload, ANN, 1, now_s, 0, self.opening, generation))

    async def refusal(self) -> GateRefusal:
        """Of the only command that it ever gets."""
        self.receiver.start()
        self.says(b'{"v": 1.0}')
        await until(lambda: self.done)
        self.receiver.close()
        await self.receiver.closed()
        [outcome] = self.done
        assert outcome.refusal is not None
        return outcome.refusal

    async def hanging(self) -> None:
        self.handler.goes_on.clear()
        self.says(b'{"v": 1.0}')
        await until(self.handler.hangs.is_set)

    def stop(self) -> None:
        self.fence.stop("ann", "", "1")


@pytest.fixture(params=[Slow, SlowAsync])
async def scene(request: pytest.FixtureRequest) -> AsyncIterator[Scene]:
    it = Scene(request.param())
    it.safety.start()
    it.receiver.start()
    yield it
    it.handler.goes_on.set()
    it.receiver.close()
    await it.receiver.closed()
    it.safety.close()


async def test_who_closes_the_channel_takes_its_own_commands_along_and_nobody_elses(scene: Scene) -> None:
    bob = Sender("bob", "t")
    opening, generation = scene.receiver.channel_opened(bob), scene.receiver.watch.generation
    scene.receiver.hold()
    scene.receiver.accept(Incoming("slow", b'{"v": 0.5}', bob, 1, time.monotonic(), 0, opening, generation))
    scene.says(b'{"v": 1.0}')
    scene.receiver.channel_closed(bob)
    scene.receiver.resume()
    await until(lambda: scene.done)
    assert [outcome.item.sender for outcome in scene.done] == [ANN]
    assert scene.handler.speed == 1.0


async def test_what_a_command_does_after_a_stop_overtook_it_is_undone_and_it_counts_as_refused(scene: Scene) -> None:
    await scene.hanging()
    scene.stop()
    await until(lambda: scene.handler.made_safe)
    scene.handler.goes_on.set()
    await until(lambda: scene.done)
    await until(lambda: scene.handler.speed == 0.0)
    [outcome] = scene.done
    assert outcome.refusal is not None
    assert (outcome.refusal.gate, outcome.refusal.code) == (Gate.HANDLER, "safety.stop")


async def test_while_a_command_hangs_the_safe_action_is_repeated(scene: Scene) -> None:
    await scene.hanging()
    scene.stop()
    await until(lambda: scene.handler.made_safe)
    scene.handler.speed = 1.0  # the device moves only now, and handle_data still does not return
    await until(lambda: scene.handler.speed == 0.0)
    assert scene.handler.made_safe >= 2


async def test_once_the_command_has_returned_nothing_is_repeated_and_a_newer_one_moves(scene: Scene) -> None:
    await scene.hanging()
    scene.receiver.watch.make_safe("safety.timeout")
    await until(lambda: scene.handler.made_safe)
    scene.handler.goes_on.set()
    await until(lambda: scene.done and not scene.receiver.watch.is_unsettled)
    made_safe = scene.handler.made_safe
    scene.says(b'{"v": 0.5}')
    await until(lambda: len(scene.done) == 2)
    assert (scene.done[1].refusal, scene.handler.speed, scene.handler.made_safe) == (None, 0.5, made_safe)
    assert scene.receiver.watch.due_at_s is not None
    assert scene.receiver.watch.due_at_s > time.monotonic() + 10.0, "only the time-out is due"


class Ending(Slow):
    """Lets out what usually ends a task, or the program."""

    error: type[BaseException] = asyncio.CancelledError

    async def handle_data(self, data: dict[str, Any]) -> None:  # type: ignore[override]
        if data["v"] < 0:
            raise self.error
        self.speed = data["v"]


@pytest.mark.parametrize("error", [asyncio.CancelledError, KeyboardInterrupt])
async def test_an_async_handle_data_that_raises_what_would_end_its_task_fails_and_takes_the_next_command(
    error: type[BaseException],
) -> None:
    handler = Ending()
    handler.error = error
    scene = Scene(handler)
    scene.receiver.start()
    scene.says(b'{"v": -1.0}')
    await until(lambda: scene.done)
    assert scene.done[0].refusal is not None
    assert (scene.done[0].refusal.gate, scene.done[0].refusal.code) == (Gate.HANDLER, "plugin.failed")
    bob = Sender("bob", "t")  # whoever sent what broke it rests
    opening = scene.receiver.channel_opened(bob)
    scene.receiver.accept(Incoming("slow", b'{"v": 0.5}', bob, 1, time.monotonic(), 0, opening, 0))
    await until(lambda: handler.speed == 0.5)
    scene.receiver.close()
    await scene.receiver.closed()


class Mule(Slow):
    """Swallows what cancels its ``handle_data``: once, or for ever."""

    def __init__(self, swallows: int) -> None:
        super().__init__()
        self.swallows = swallows
        self.let_go = asyncio.Event()

    async def handle_data(self, data: dict[str, Any]) -> None:  # type: ignore[override]
        self.hangs.set()
        while self.swallows and not self.let_go.is_set():
            try:
                await self.let_go.wait()
            except asyncio.CancelledError:
                self.swallows -= 1


async def test_a_handle_data_that_swallows_its_cancellation_once_ends_its_receiver() -> None:
    scene = Scene(Mule(swallows=1))
    scene.receiver.start()
    await scene.hanging()
    begun_s = time.monotonic()
    scene.receiver.close()
    await scene.receiver.closed()
    assert time.monotonic() - begun_s < STOP_PATIENCE_S, "nobody waits for the next command of a robot that ends"


async def test_a_handle_data_that_swallows_its_cancellation_for_ever_is_named_and_left_behind(
    caplog: pytest.LogCaptureFixture,
) -> None:
    handler = Mule(swallows=10_000)
    scene = Scene(handler)
    scene.receiver.start()
    await scene.hanging()
    scene.receiver.close()
    await scene.receiver.closed()
    assert "connector 'slow' did not stop" in caplog.text
    left = [task for task in asyncio.all_tasks() if task.get_name() == "mosaic-slow"]
    handler.let_go.set()
    await asyncio.sleep(0.01)
    assert not left, "asyncio.run would wait for it"


class Broken(Slow):
    def handle_data(self, data: dict[str, Any]) -> None:
        raise OSError("the bus is gone")


async def test_what_a_plugin_raised_is_in_the_robots_log_and_not_in_what_its_operator_is_told(
    caplog: pytest.LogCaptureFixture,
) -> None:
    scene = Scene(Broken())
    refusal = await scene.refusal()
    assert refusal.code == "plugin.failed"
    assert "bus" not in refusal.message
    assert "the bus is gone" in caplog.text


class Reading(Message):
    v: float

    @field_validator("v")
    @classmethod
    def _looked_up(cls, v: float) -> float:
        raise OSError("the table is gone")


class Typed(DataChannelReceivable[Reading]):
    def handle_data(self, data: Reading) -> None:
        raise AssertionError("nothing was read")


async def test_a_message_whose_own_check_breaks_fails_like_its_handle_data(caplog: pytest.LogCaptureFixture) -> None:
    scene = Scene(Typed("slow"))
    refusal = await scene.refusal()
    assert (refusal.gate, refusal.code) == (Gate.HANDLER, "plugin.failed")
    assert "the table is gone" in caplog.text
