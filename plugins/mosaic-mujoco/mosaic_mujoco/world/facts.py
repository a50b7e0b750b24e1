"""Tells what a model has: its cameras, joints, actuators, sensors, bodies and key frames. Plain data, no MuJoCo."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias

from mosaic_core.words.errors import hint_at

JointKind: TypeAlias = Literal["free", "ball", "slide", "hinge"]
ActuatorKind: TypeAlias = Literal["position", "velocity", "other"]
NameKind: TypeAlias = Literal["camera", "joint", "actuator", "sensor", "body", "key frame"]

MANY = 12
"""So many names are told in an error; a humanoid has hundreds."""


@dataclass(frozen=True, slots=True)
class Span:
    """A range, from its lowest to its highest value."""

    low: float
    high: float

    def clamped(self, value: float) -> float:
        return min(self.high, max(self.low, value))

    def within(self, other: Span | None) -> Span:
        """What both have; this one where they have nothing in common."""
        if other is None or other.low > self.high or other.high < self.low:
            return self
        return Span(max(self.low, other.low), min(self.high, other.high))


@dataclass(frozen=True, slots=True)
class JointFact:
    """A joint. ``range``: rad, of a slide m; ``None``: it has no stops."""

    id: int
    name: str
    kind: JointKind
    position_at: int
    velocity_at: int
    range: Span | None
    body: str

    @property
    def unit(self) -> str:
        return "m" if self.kind == "slide" else "rad"


@dataclass(frozen=True, slots=True)
class ActuatorFact:
    """An actuator. ``range`` is that of its control signal; ``joint``: the one that it drives; ``None``: a tendon, a
    site or a body. ``gear``: how far it moves for each unit of the joint."""

    id: int
    name: str
    kind: ActuatorKind
    joint: str | None
    range: Span | None
    gear: float


@dataclass(frozen=True, slots=True)
class SensorFact:
    """A sensor. ``kind`` is the word of the XML, such as ``gyro``; its values are ``size`` numbers from ``at`` on.
    ``target``: what it is fixed to, and ``reference``: in whose frame it tells; sensors that share both measure the
    same. ``cutoff``: 0 where it has none."""

    id: int
    name: str
    kind: str
    at: int
    size: int
    target: tuple[int, int]
    reference: tuple[int, int]
    cutoff: float
    unit: str


@dataclass(frozen=True, slots=True)
class ModelFacts:
    """What a model has. Things without a name are left out: nothing can name them."""

    name: str
    timestep_s: float
    cameras: tuple[str, ...]
    joints: tuple[JointFact, ...]
    actuators: tuple[ActuatorFact, ...]
    sensors: tuple[SensorFact, ...]
    bodies: tuple[str, ...]
    keys: tuple[str, ...]
    parents: Mapping[str, str]
    """Of each body the one that carries it; of the lowest `world`, or nothing that has a name."""

    def names(self, kind: NameKind) -> tuple[str, ...]:
        """All names of one kind of things."""
        return {
            "camera": self.cameras,
            "joint": tuple(one.name for one in self.joints),
            "actuator": tuple(one.name for one in self.actuators),
            "sensor": tuple(one.name for one in self.sensors),
            "body": self.bodies,
            "key frame": self.keys,
        }[kind]

    def check_name(self, kind: NameKind, name: str, among: Sequence[str] | None = None, what: str = "") -> None:
        """Raises :class:`ValueError` with the nearest name and what there is, if ``name`` is none of all that the model
        has, or of ``among``, which are ``what``."""
        known = self.names(kind) if among is None else among
        if name in known:
            return
        what = what or kind
        more = f" and {len(known) - MANY} more" if len(known) > MANY else ""
        has = f"It has {', '.join(known[:MANY])}{more}" if known else "It has none at all"
        raise ValueError(f"the model {self.name} has no {what} '{name}'{hint_at(name, known)} {has}")

    def joint(self, name: str) -> JointFact:
        """Raises :class:`ValueError` as :meth:`check_name`."""
        self.check_name("joint", name)
        return next(one for one in self.joints if one.name == name)

    def actuator(self, name: str) -> ActuatorFact:
        """Raises :class:`ValueError` as :meth:`check_name`."""
        self.check_name("actuator", name)
        return next(one for one in self.actuators if one.name == name)

    def sensor(self, name: str) -> SensorFact:
        """Raises :class:`ValueError` as :meth:`check_name`."""
        self.check_name("sensor", name)
        return next(one for one in self.sensors if one.name == name)

    def beside(self, sensor: SensorFact, kind: str) -> SensorFact | None:
        """The sensor of this kind that is fixed to the same place, if there is one."""
        place = sensor.target, sensor.reference
        return next((one for one in self.sensors if one.kind == kind and (one.target, one.reference) == place), None)

    def carried_by(self, body: str) -> tuple[str, ...]:
        """The names of the joints that ``body`` has or carries."""
        return tuple(one.name for one in self.joints if body in self._down_to_the_world(one.body))

    def _down_to_the_world(self, body: str) -> set[str]:
        passed: set[str] = set()
        while body and body not in passed:
            passed.add(body)
            body = self.parents.get(body, "")
        return passed

    def turning(self) -> tuple[JointFact, ...]:
        """The joints with one number: hinges and slides."""
        return tuple(one for one in self.joints if one.kind in ("hinge", "slide"))

    def servos(self) -> dict[str, ActuatorFact]:
        """By joint, the position actuator that moves it."""
        known = {one.name for one in self.turning()}
        found = (one for one in self.actuators if one.kind == "position" and one.joint in known and one.gear)
        return {one.joint: one for one in found if one.joint is not None}
