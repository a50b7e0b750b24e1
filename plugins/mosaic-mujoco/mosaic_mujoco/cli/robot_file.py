"""Makes the connectors of a robot out of what its model has. Pure."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from mosaic_mujoco.connectors.odometry import base_of
from mosaic_mujoco.connectors.sensor import imu_of
from mosaic_mujoco.world.facts import ActuatorFact, ModelFacts, SensorFact

Entry = dict[str, Any]

MAX_CAMERAS = 3
MAX_SENSORS = 12
"""More are a page that nobody reads; whoever wants them names them."""
_GRIPPERS = re.compile(r"grip|finger|hand|claw|jaw", re.IGNORECASE)
_LEFT, _RIGHT = re.compile(r"(?<![a-z])(left|l)(?![a-z])", re.I), re.compile(r"(?<![a-z])(right|r)(?![a-z])", re.I)
_PERIOD_S = 0.1


@dataclass(frozen=True, slots=True)
class WheelSizes:
    """What the drive of a vehicle needs to know, as far as the model's shapes tell it."""

    radius_m: float | None = None
    track_m: float | None = None


def connectors_of(model: str, facts: ModelFacts, wheels: WheelSizes) -> list[Entry]:
    """The entries for ``connectors:``; ``wheels``: of :func:`sides_of`."""
    taken: set[str] = set()
    made = [*_cameras(facts), *_joints(facts), *_wheels(facts, wheels), *_sensors(facts), *_about(facts)]
    for entry in made:
        entry["label"] = _free(entry["label"], taken)
        place = entry["params"].get("drive", entry["params"])
        named = {key: value for key, value in place.items() if key != "type"}
        place.clear()
        place.update({"type": "mujoco"} if place is not entry["params"] else {}, model=model, **named)
    return made


def gripper_of(facts: ModelFacts) -> ActuatorFact | None:
    """The position actuator that is a gripper's by its name."""
    servos = [one for one in facts.actuators if one.kind == "position" and one.range is not None]
    return next((one for one in servos if _GRIPPERS.search(one.name)), None)


def sides_of(facts: ModelFacts) -> tuple[list[ActuatorFact], list[ActuatorFact]]:
    """The velocity actuators of the left and of the right wheels, by their names."""
    wheels = [one for one in facts.actuators if one.kind == "velocity" and one.joint]
    sides = [[one for one in wheels if side.search(one.name)] for side in (_LEFT, _RIGHT)]
    return sides[0], sides[1]


def _entry(kind: str, label: str, **params: Any) -> Entry:
    return {"type": kind, "label": label, "params": params}


def _cameras(facts: ModelFacts) -> Iterator[Entry]:
    for name in facts.cameras[:MAX_CAMERAS]:
        yield _entry("mujoco-camera", name, camera=name)
    if not facts.cameras:
        yield _entry("mujoco-camera", "view")


def _joints(facts: ModelFacts) -> Iterator[Entry]:
    if facts.turning():
        yield _entry("mujoco-joints", "joints", period_s=_PERIOD_S)
    gripper = gripper_of(facts)
    arm = [name for name, servo in facts.servos().items() if gripper is None or not _GRIPPERS.search(servo.name)]
    if arm:
        yield _entry("mujoco-joint-target", "arm", joints=arm)
    if gripper is not None:
        yield _entry("mujoco-gripper-target", "gripper", actuator=gripper.name)


def _wheels(facts: ModelFacts, wheels: WheelSizes) -> Iterator[Entry]:
    left, right = sides_of(facts)
    if left and right and wheels.radius_m and wheels.track_m:
        drive = {
            "type": "mujoco",
            "left": [one.name for one in left],
            "right": [one.name for one in right],
            "wheel_radius_m": round(wheels.radius_m, 4),
            "track_width_m": round(wheels.track_m, 4),
        }
        yield _entry("cmd-vel", "cmd_vel", drive=drive)
    base = base_of(facts)
    if base is not None:
        yield _entry("mujoco-odometry", "pose", body=base)


def _sensors(facts: ModelFacts) -> Iterator[Entry]:
    """Each by the first of those that are told together."""
    told: set[str] = set()
    for sensor in facts.sensors:
        if sensor.name not in told and len(told) < MAX_SENSORS:
            told |= _told_with(facts, sensor)
            if sensor.kind != "framequat" or not _is_told_elsewhere(facts, sensor):
                yield _entry("mujoco-sensor", sensor.name, sensor=sensor.name, period_s=_PERIOD_S)


def _told_with(facts: ModelFacts, sensor: SensorFact) -> set[str]:
    gyro, acceleration = imu_of(facts, sensor)
    return {sensor.name} | ({gyro.name, acceleration.name} if gyro and acceleration else set())


def _is_told_elsewhere(facts: ModelFacts, attitude: SensorFact) -> bool:
    gyro, acceleration = (facts.beside(attitude, kind) for kind in ("gyro", "accelerometer"))
    return facts.beside(attitude, "framepos") is not None or (gyro is not None and acceleration is not None)


def _about(facts: ModelFacts) -> Iterator[Entry]:
    yield _entry("mujoco-reset", "reset")
    yield _entry("mujoco-control", "simulation")
    yield _entry("mujoco-health", "health")


def _free(name: str, taken: set[str]) -> str:
    """A label that nothing else has, made of a name of the model."""
    plain = re.sub(r"[^a-z0-9_]+", "_", name.lower()).strip("_")[:40] or "unnamed"
    free, number = plain, 1
    while free in taken:
        number += 1
        free = f"{plain}_{number}"
    taken.add(free)
    return free
