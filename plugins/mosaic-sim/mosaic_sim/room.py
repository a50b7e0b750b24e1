"""The room: what stands where, as plain arrays. Metres, x east, y north; ``raycast`` and ``motion`` only read it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Floats: TypeAlias = NDArray[np.float64]


class Material(IntEnum):
    """The material of a surface: the renderer's texture, and how brightly a laser comes back."""

    NORTH = 0
    EAST = 1
    SOUTH = 2
    WEST = 3
    DIVIDER = 4
    PILLAR = 5
    CRATE = 6
    BARREL_RED = 7
    BARREL_BLUE = 8
    CONE = 9


@dataclass(frozen=True, slots=True)
class Wall:
    """A straight wall from ``a`` to ``b``, as tall as the room."""

    a: tuple[float, float]
    b: tuple[float, float]
    material: Material


@dataclass(frozen=True, slots=True)
class Box:
    """A crate: ``size_m`` square, turned by ``yaw_rad``, lower than the walls."""

    x_m: float
    y_m: float
    size_m: float
    yaw_rad: float = 0.0
    material: Material = Material.CRATE

    def corners(self) -> list[tuple[float, float]]:
        half_diagonal = self.size_m / math.sqrt(2)
        angles = [self.yaw_rad + math.pi / 4 + k * math.pi / 2 for k in range(4)]
        return [(self.x_m + half_diagonal * math.cos(a), self.y_m + half_diagonal * math.sin(a)) for a in angles]


@dataclass(frozen=True, slots=True)
class Post:
    """A round obstacle: a barrel (low) or a pillar (``is_tall``)."""

    x_m: float
    y_m: float
    radius_m: float
    material: Material
    is_tall: bool = False


Solid: TypeAlias = Wall | Box | Post


@dataclass(frozen=True, slots=True)
class Segments:
    """Straight surfaces, one row each: end points, material, height class and texture repeats."""

    a: Floats
    b: Floats
    material: NDArray[np.intp]
    is_tall: NDArray[np.bool_]
    repeats: Floats


@dataclass(frozen=True, slots=True)
class Circles:
    """Round surfaces, one row each."""

    centre: Floats
    radius_m: Floats
    material: NDArray[np.intp]
    is_tall: NDArray[np.bool_]


@dataclass(frozen=True)
class Room:
    """Everything a robot can see, touch or park on.

    ``half_x_m`` and ``half_y_m`` span the outer walls around the origin; ``dock`` is the centre of the charging pad.
    """

    half_x_m: float
    half_y_m: float
    solids: tuple[Solid, ...]
    dock: tuple[float, float] = (0.0, 0.0)
    dock_half_m: float = 0.45
    wall_height_m: float = 1.3
    low_height_m: float = 0.62

    @cached_property
    def segments(self) -> Segments:
        rows: list[tuple[float, float, float, float, int, bool, float]] = []
        for solid in self.solids:
            if isinstance(solid, Wall):
                length_m = math.dist(solid.a, solid.b)
                rows.append((*solid.a, *solid.b, solid.material, True, max(1.0, round(length_m / self.wall_height_m))))
            elif isinstance(solid, Box):
                corners = solid.corners()
                for start, end in zip(corners, corners[1:] + corners[:1], strict=True):
                    rows.append((*start, *end, solid.material, False, 1.0))
        table = np.array(rows, dtype=np.float64).reshape(-1, 7)
        return Segments(
            a=table[:, 0:2],
            b=table[:, 2:4],
            material=table[:, 4].astype(np.intp),
            is_tall=table[:, 5].astype(np.bool_),
            repeats=table[:, 6],
        )

    @cached_property
    def circles(self) -> Circles:
        posts = [solid for solid in self.solids if isinstance(solid, Post)]
        table = np.array([(p.x_m, p.y_m, p.radius_m, p.material, p.is_tall) for p in posts], dtype=np.float64)
        table = table.reshape(-1, 5)
        return Circles(
            centre=table[:, 0:2],
            radius_m=table[:, 2],
            material=table[:, 3].astype(np.intp),
            is_tall=table[:, 4].astype(np.bool_),
        )

    def is_docked(self, x_m: float, y_m: float) -> bool:
        """Whether this place is on the charging pad."""
        return abs(x_m - self.dock[0]) <= self.dock_half_m and abs(y_m - self.dock[1]) <= self.dock_half_m

    def contains(self, x_m: float, y_m: float) -> bool:
        """Whether this point is inside the outer walls and in no obstacle."""
        if abs(x_m) >= self.half_x_m or abs(y_m) >= self.half_y_m:
            return False
        return not any(_covers(solid, x_m, y_m) for solid in self.solids)


def _covers(solid: Solid, x_m: float, y_m: float) -> bool:
    if isinstance(solid, Post):
        return math.hypot(x_m - solid.x_m, y_m - solid.y_m) < solid.radius_m
    if isinstance(solid, Box):
        cos, sin = math.cos(-solid.yaw_rad), math.sin(-solid.yaw_rad)
        dx, dy = x_m - solid.x_m, y_m - solid.y_m
        half = solid.size_m / 2
        return abs(cos * dx - sin * dy) < half and abs(sin * dx + cos * dy) < half
    return False


def outer_walls(half_x_m: float, half_y_m: float) -> list[Wall]:
    """Four walls around the origin; each side has its own colour, so that a driver knows which way he looks."""
    sw, se, ne, nw = (-half_x_m, -half_y_m), (half_x_m, -half_y_m), (half_x_m, half_y_m), (-half_x_m, half_y_m)
    return [
        Wall(sw, se, Material.SOUTH),
        Wall(se, ne, Material.EAST),
        Wall(ne, nw, Material.NORTH),
        Wall(nw, sw, Material.WEST),
    ]


COURTYARD_HALF_M = (6.0, 4.5)
COURTYARD_START = (-3.6, -2.6, 0.3)
"""Where the robot wakes up: x, y in metres, yaw in radians."""


def courtyard(seed: int = 1) -> Room:
    """The walled yard of the demo: two bays, a doorway, pillars, and crates and barrels scattered by ``seed``."""
    fixed: list[Solid] = [
        *outer_walls(*COURTYARD_HALF_M),
        Wall((0.6, 4.5), (0.6, 1.5), Material.DIVIDER),
        Wall((0.6, 1.5), (2.4, 1.5), Material.DIVIDER),
        Wall((-6.0, 0.6), (-3.6, 0.6), Material.DIVIDER),
        Post(0.6, -1.6, 0.18, Material.PILLAR, is_tall=True),
        Post(3.4, -1.6, 0.18, Material.PILLAR, is_tall=True),
        Box(1.1, -3.2, 0.6, 0.3),
        Box(4.3, 0.6, 0.7, 0.6),
    ]
    dock = (-5.2, -3.7)
    scattered = _scattered(np.random.default_rng(seed), fixed, keep_free=(COURTYARD_START[:2], dock))
    return Room(*COURTYARD_HALF_M, solids=(*fixed, *scattered), dock=dock)


def _scattered(
    rng: np.random.Generator, fixed: Sequence[Solid], keep_free: Sequence[tuple[float, float]]
) -> list[Solid]:
    """Nine low obstacles, each at least 1.1 m from every other thing, so that the robot always finds a way."""
    found: list[Solid] = []
    for _ in range(5000):  # a bound, because a small room may have no place for nine
        if len(found) == 9:
            break
        x_m, y_m = float(rng.uniform(-5.2, 5.2)), float(rng.uniform(-3.7, 3.7))
        if all(_gap_m(solid, x_m, y_m) > 1.1 for solid in (*fixed, *found)) and all(
            math.dist((x_m, y_m), place) > 1.5 for place in keep_free
        ):
            found.append(_obstacle(rng, len(found), x_m, y_m))
    return found


def _obstacle(rng: np.random.Generator, number: int, x_m: float, y_m: float) -> Solid:
    kind = number % 4
    if kind == 0:
        return Box(x_m, y_m, 0.55, float(rng.uniform(0, math.pi / 2)))
    if kind == 3:
        return Post(x_m, y_m, 0.14, Material.CONE)
    return Post(x_m, y_m, 0.24, Material.BARREL_RED if kind == 1 else Material.BARREL_BLUE)


def _gap_m(solid: Solid, x_m: float, y_m: float) -> float:
    if isinstance(solid, Wall):
        return distance_to_segment_m(solid.a, solid.b, (x_m, y_m))
    radius_m = solid.radius_m if isinstance(solid, Post) else solid.size_m / math.sqrt(2)
    return math.dist((solid.x_m, solid.y_m), (x_m, y_m)) - radius_m


def distance_to_segment_m(a: tuple[float, float], b: tuple[float, float], p: tuple[float, float]) -> float:
    """From ``p`` to the nearest point of the segment ``a``–``b``."""
    ex, ey = b[0] - a[0], b[1] - a[1]
    along = ((p[0] - a[0]) * ex + (p[1] - a[1]) * ey) / (ex * ex + ey * ey)
    along = min(1.0, max(0.0, along))
    return math.hypot(a[0] + along * ex - p[0], a[1] + along * ey - p[1])
