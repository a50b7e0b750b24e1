"""Promise 1: a motion receiver is safe in time, whatever in its own process hangs."""

from __future__ import annotations

import asyncio
import threading
import time
from typing import Any

import pytest

from mosaic_core import DataChannelJsonReceivable
from mosaic_core.words.data_type import Delivery

TIMEOUT_S = 0.15


class Wheels(DataChannelJsonReceivable):
    timeout_s = TIMEOUT_S

    def __init__(self) -> None:
        super().__init__("drive")
        self.log: list[tuple[Any, float]] = []
        self.hang = threading.Event()
        self.hang.set()

    def handle_data(self, data: dict[str, Any]) -> None:
        self.log.append((data["v"], time.monotonic()))
        self.hang.wait(5)

    def make_safe(self, cause: str) -> None:
        self.log.append((cause, time.monotonic()))


async def _drive(kit: Any, scene: Any, wheels: Wheels) -> Any:
    operator, _ = await scene.greeted()
    drive = operator.open("drive")
    drive.say({"v": 1})
    await kit.until(lambda: wheels.log)
    return drive


async def test_a_blocked_event_loop_does_not_keep_it_moving(kit: Any) -> None:
    wheels = Wheels()

    async with kit.running(kit.connector_of(wheels, delivery=Delivery.LATEST)) as scene:
        await _drive(kit, scene, wheels)
        time.sleep(0.4)  # noqa: ASYNC251 (blocking the loop is the point)
        (_, commanded_s), (cause, safe_s) = wheels.log
        assert cause == "safety.timeout"
        assert safe_s - commanded_s == pytest.approx(TIMEOUT_S, abs=0.05)


async def test_a_hanging_handle_data_is_made_safe_and_the_commands_behind_it_are_too_old(kit: Any) -> None:
    wheels = Wheels()
    wheels.hang.clear()

    async with kit.running(kit.connector_of(wheels, delivery=Delivery.LATEST)) as scene:
        drive = await _drive(kit, scene, wheels)
        drive.say({"v": 2})
        await kit.until(lambda: len(wheels.log) == 2)
        (_, commanded_s), (cause, safe_s) = wheels.log
        assert cause == "safety.timeout"
        assert safe_s - commanded_s == pytest.approx(TIMEOUT_S, abs=0.05)
        await asyncio.sleep(TIMEOUT_S)
        wheels.hang.set()
        await kit.until(lambda: len(scene.hooks.of("command")) == 2)
        assert [call["code"] for call in scene.hooks.of("command")] == ["safety.timeout", "safety.stale"]
        causes = {entry for entry, _ in wheels.log[1:]}
        assert (wheels.log[0][0], causes) == (1, {"safety.timeout"}), "again and again while it hung"


async def test_what_a_command_set_going_before_it_broke_is_made_safe_too(kit: Any) -> None:
    class HalfDone(Wheels):
        def handle_data(self, data: dict[str, Any]) -> None:
            super().handle_data(data)
            raise OSError("the other wheel does not answer")

    wheels = HalfDone()

    async with kit.running(kit.connector_of(wheels)) as scene:
        await _drive(kit, scene, wheels)
        await kit.until(lambda: len(wheels.log) == 2)
        assert [entry for entry, _ in wheels.log] == [1, "safety.timeout"]
