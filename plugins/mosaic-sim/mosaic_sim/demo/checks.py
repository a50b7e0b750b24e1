"""Checks the demo without a browser, one small function each, over the stores of a connected operator."""

from __future__ import annotations

import asyncio
import json
import math
import time
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import Any, Protocol

WARM_UP_PICTURES = 5
"""The first ones come in a burst, as they queued while the decoder started."""
PICTURES = 20
DRIVE_S = 1.5
COMMAND_PERIOD_S = 0.05
DRIVE_MPS = 0.6
MUST_MOVE_M = 0.3
STANDSTILL_MPS = 0.01
STOP_WITHIN_S = 1.2
"""0.3 s of silence, then braking from 0.6 m/s, plus the way of the news."""
REST_S = 0.5


@dataclass(frozen=True, slots=True)
class Result:
    """One line of the report."""

    name: str
    is_ok: bool
    detail: str

    def wire(self) -> dict[str, Any]:
        return {"name": self.name, "ok": self.is_ok, "detail": self.detail}

    @classmethod
    def of_wire(cls, line: dict[str, Any]) -> Result:
        return cls(str(line["name"]), bool(line["ok"]), str(line["detail"]))


class CheckFailed(Exception):
    """A check that did not hold; the text says what was seen instead."""


class CameraCheck(Protocol):
    async def next_image(self, timeout_s: float = 10.0) -> Any: ...


class Sensor(Protocol):
    async def next_message(self, timeout_s: float = 10.0) -> Any: ...


class Wheels(Protocol):
    def send_json(self, value: dict[str, Any]) -> bool: ...


class Held(Protocol):
    @property
    def resource(self) -> str: ...


class Control(Protocol):
    async def take(self, resource: str, *, reason: str = "", wait_s: float = 0.0) -> Held: ...


async def told(name: str, check: Callable[[], Awaitable[str]]) -> Result:
    """Run one check; whatever goes wrong becomes a line of the report, so that the others still run."""
    try:
        return Result(name, True, await check())
    except TimeoutError:
        return Result(name, False, "nothing arrived in time")
    except Exception as error:  # noqa: BLE001 - the report is where errors of a check belong
        return Result(name, False, str(error) or type(error).__name__)


async def pictures_arrive(camera: CameraCheck) -> str:
    first = await camera.next_image()
    for _ in range(WARM_UP_PICTURES):
        await camera.next_image(timeout_s=3.0)
    began_s = time.monotonic()
    for _ in range(PICTURES):
        await camera.next_image(timeout_s=3.0)
    rate = PICTURES / (time.monotonic() - began_s)
    if int(first.max()) - int(first.min()) < 50:
        raise CheckFailed("pictures arrive but show nothing")
    return f"{first.shape[1]}×{first.shape[0]}, {rate:.0f} per second"


async def messages_arrive(sensor: Sensor) -> str:
    first = json.loads((await sensor.next_message(5.0)).data)
    return ", ".join(list(first)[:4])


async def lease_is_granted(control: Control) -> str:
    """Only the holder of the lease drives."""
    lease = await control.take("motion", reason="checking the demo", wait_s=5.0)
    return f"of {lease.resource}"


async def driving_moves(wheels: Wheels, pose: Sensor) -> str:
    """Drive ahead for a moment; the pose must have changed by then."""
    before = _place(await pose.next_message(5.0))
    end_s = time.monotonic() + DRIVE_S
    while time.monotonic() < end_s:
        if not wheels.send_json({"linear": {"x": DRIVE_MPS}, "angular": {"z": 0.0}}):
            raise CheckFailed("a command was not accepted")
        await asyncio.sleep(COMMAND_PERIOD_S)
    moved_m = math.dist(before, _place(await pose.next_message(5.0)))
    if moved_m < MUST_MOVE_M:
        raise CheckFailed(f"commanded {DRIVE_MPS} m/s for {DRIVE_S} s, but it moved {moved_m:.2f} m only")
    return f"moved {moved_m:.2f} m"


async def silence_stops(pose: Sensor) -> str:
    """Send nothing any more; the robot must come to rest by itself and stay at rest."""
    began_s = time.monotonic()
    while (speed_mps := _speed(message := await pose.next_message(5.0))) > STANDSTILL_MPS:
        if time.monotonic() - began_s > STOP_WITHIN_S:
            raise CheckFailed(f"still {speed_mps:.2f} m/s after {STOP_WITHIN_S} s of silence")
    stopped_s, place = time.monotonic() - began_s, _place(message)
    end_s = time.monotonic() + REST_S
    while time.monotonic() < end_s:
        message = await pose.next_message(5.0)
    if math.dist(place, _place(message)) > 0.02:
        raise CheckFailed("it stopped and moved again")
    return f"at rest {stopped_s:.2f} s after the last command"


def _place(message: Any) -> tuple[float, float]:
    position = json.loads(message.data)["position"]
    return float(position["x"]), float(position["y"])


def _speed(message: Any) -> float:
    return abs(float(json.loads(message.data)["twist"]["linear"]["x"]))
