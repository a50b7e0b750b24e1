"""The floor of the room in cells: what stands where, how much room there is, and the way to a place."""

from __future__ import annotations

import heapq
import math
from collections.abc import Iterator
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from mosaic_sim.room import Box, Floats, Room

CELL_M = 0.1
WAY_ROOM_M = 0.3
"""Between the middle of a way and what stands beside it: the robot's radius and a hand's breadth."""
_STEPS = [(dx, dy, math.hypot(dx, dy)) for dx in (-1, 0, 1) for dy in (-1, 0, 1) if (dx, dy) != (0, 0)]

Cell = tuple[int, int]
"""Column and row."""


class FloorPlan:
    """The plan of one room. Pure; any thread."""

    def __init__(self, room: Room) -> None:
        self._room = room
        self.columns = round(2 * room.half_x_m / CELL_M)
        self.rows = round(2 * room.half_y_m / CELL_M)

    @cached_property
    def clearance_m(self) -> Floats:
        """How far it is from the middle of each cell, (rows, columns), to the nearest thing; 0 inside one."""
        x, y = np.meshgrid(
            (np.arange(self.columns) + 0.5) * CELL_M - self._room.half_x_m,
            (np.arange(self.rows) + 0.5) * CELL_M - self._room.half_y_m,
        )
        nearest = np.full(x.shape, np.inf)
        for a, b in zip(self._room.segments.a, self._room.segments.b, strict=True):
            nearest = np.minimum(nearest, _from_segment_m(x, y, a, b))
        for (centre_x, centre_y), radius_m in zip(self._room.circles.centre, self._room.circles.radius_m, strict=True):
            nearest = np.minimum(nearest, np.hypot(x - centre_x, y - centre_y) - radius_m)
        for box in self._room.solids:
            if isinstance(box, Box):
                nearest[_inside(box, x, y)] = 0.0
        return np.maximum(nearest, 0.0)

    @cached_property
    def occupied(self) -> NDArray[np.bool_]:
        """The cells, (rows, columns), that something reaches into."""
        return np.asarray(self.clearance_m < CELL_M / 2)

    def cell_of(self, x_m: float, y_m: float) -> Cell:
        """The nearest cell of the room."""
        column = math.floor((x_m + self._room.half_x_m) / CELL_M)
        row = math.floor((y_m + self._room.half_y_m) / CELL_M)
        return min(self.columns - 1, max(0, column)), min(self.rows - 1, max(0, row))

    def middle_of(self, cell: Cell) -> tuple[float, float]:
        """Metres of the room."""
        return (cell[0] + 0.5) * CELL_M - self._room.half_x_m, (cell[1] + 0.5) * CELL_M - self._room.half_y_m

    def way(self, start: tuple[float, float], goal: tuple[float, float]) -> list[tuple[float, float]]:
        """The shortest way with room for the robot, in metres from cell to cell; empty where there is none (A*)."""
        first, last = self.cell_of(*start), self.cell_of(*goal)
        came_from: dict[Cell, Cell] = {first: first}
        lengths = {first: 0.0}
        waiting = [(0.0, first)]
        while waiting:
            _, cell = heapq.heappop(waiting)
            if cell == last:
                return [self.middle_of(one) for one in _back(came_from, cell)]
            for neighbour, step in self._neighbours(cell, last):
                length = lengths[cell] + step
                if length < lengths.get(neighbour, math.inf):
                    lengths[neighbour], came_from[neighbour] = length, cell
                    heapq.heappush(waiting, (length + math.dist(neighbour, last), neighbour))
        return []

    def _neighbours(self, cell: Cell, goal: Cell) -> Iterator[tuple[Cell, float]]:
        for dx, dy, step in _STEPS:
            column, row = cell[0] + dx, cell[1] + dy
            if not (0 <= column < self.columns and 0 <= row < self.rows):
                continue
            if (column, row) == goal or self.clearance_m[row, column] > WAY_ROOM_M:
                yield (column, row), step


def _back(came_from: dict[Cell, Cell], cell: Cell) -> list[Cell]:
    way = [cell]
    while came_from[cell] != cell:
        cell = came_from[cell]
        way.append(cell)
    return way[::-1]


def _from_segment_m(x: Floats, y: Floats, a: Floats, b: Floats) -> Floats:
    ex, ey = b - a
    along = np.clip(((x - a[0]) * ex + (y - a[1]) * ey) / (ex * ex + ey * ey), 0.0, 1.0)
    return np.asarray(np.hypot(a[0] + along * ex - x, a[1] + along * ey - y))


def _inside(box: Box, x: Floats, y: Floats) -> NDArray[np.bool_]:
    cos, sin = math.cos(-box.yaw_rad), math.sin(-box.yaw_rad)
    dx, dy = x - box.x_m, y - box.y_m
    half = box.size_m / 2
    return np.asarray((np.abs(cos * dx - sin * dy) < half) & (np.abs(sin * dx + cos * dy) < half))
