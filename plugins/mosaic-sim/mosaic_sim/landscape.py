"""The two large pictures around the robot: the floor of the room seen from above, and the panorama of sky and hills."""

from __future__ import annotations

import math
from collections.abc import Generator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mosaic_sim.room import Floats, Room
from mosaic_sim.textures import LEVELS, Packed, halved, packed, smooth_noise, stretched

TEXELS_PER_M = 128
"""About five screen pixels per texel right before the camera, one from 3 m on; more would only slow the start."""
SHADE_CELL_M = 0.05
SHADOW_REACH_M = 0.35


@dataclass(frozen=True, slots=True)
class Floor:
    """The floor at every mip level in one flat array; a texel's row counts from the south, its column from the west."""

    texels: Packed
    start: NDArray[np.intp]
    width: NDArray[np.intp]
    height: NDArray[np.intp]


def floor_in_steps(room: Room, seed: int) -> Generator[None, None, Floor]:
    """Paving slabs with joints, the dock's green pad, and soft shadows at the foot of everything. It is large: whoever
    draws it may leave after each step."""
    image = _paving(room, np.random.default_rng([seed, 2]))
    _paint_dock(room, image)
    yield
    shadows = _shadows(room, (image.shape[0], image.shape[1]))
    yield
    image *= shadows[..., None]
    parts: list[Packed] = []
    starts, widths, heights = [], [], []
    for _ in range(LEVELS):
        starts.append(sum(part.size for part in parts))
        heights.append(image.shape[0])
        widths.append(image.shape[1])
        parts.append(packed(image).ravel())
        image = halved(image)
        yield
    sizes = (np.asarray(column, dtype=np.intp) for column in (starts, widths, heights))
    return Floor(np.concatenate(parts), *sizes)


def _paving(room: Room, rng: np.random.Generator) -> Floats:
    columns, rows = round(2 * room.half_x_m), round(2 * room.half_y_m)
    shape = (rows * TEXELS_PER_M, columns * TEXELS_PER_M)
    tone = 0.90 + 0.13 * rng.random((rows, columns))
    tone = np.repeat(np.repeat(tone, TEXELS_PER_M, axis=0), TEXELS_PER_M, axis=1)
    tone *= 0.94 + 0.08 * smooth_noise(rng, shape, (rows * 3, columns * 3))
    tone *= 0.965 + 0.07 * smooth_noise(rng, shape, (rows * 24, columns * 24))
    in_slab = [np.minimum(np.arange(n) % TEXELS_PER_M, TEXELS_PER_M - 1 - np.arange(n) % TEXELS_PER_M) for n in shape]
    joint = np.minimum(in_slab[0][:, None], in_slab[1]) < 3
    tone[joint] *= 0.62
    return np.asarray(tone[..., None] * np.array((146.0, 152.0, 156.0)))


def _paint_dock(room: Room, image: Floats) -> None:
    """A green square with a light border and a lightning bolt."""
    west, south = room.dock[0] + room.half_x_m - room.dock_half_m, room.dock[1] + room.half_y_m - room.dock_half_m
    size = round(2 * room.dock_half_m * TEXELS_PER_M)
    top, left = max(0, round(south * TEXELS_PER_M)), max(0, round(west * TEXELS_PER_M))
    pad = image[top : top + size, left : left + size]
    up, across = (2 * (np.arange(n) + 0.5) / size - 1.0 for n in pad.shape[:2])
    up = up[:, None]
    pad[:] = (96, 168, 64)
    pad[np.maximum(np.abs(across), np.abs(up)) > 0.86] = (214, 232, 214)
    upper = (up > -0.05) & (up < 0.62) & (np.abs(across - 0.3 * up + 0.06) < 0.17)
    lower = (up < 0.1) & (up > -0.62) & (np.abs(across - 0.3 * up - 0.08) < 0.26 * (up + 0.62))
    pad[upper | lower] = (224, 244, 250)


def _shadows(room: Room, shape: tuple[int, int]) -> Floats:
    """1 in the open, darker towards whatever stands on the floor."""
    xs = np.arange(-room.half_x_m, room.half_x_m + SHADE_CELL_M / 2, SHADE_CELL_M)
    ys = np.arange(-room.half_y_m, room.half_y_m + SHADE_CELL_M / 2, SHADE_CELL_M)
    points = np.stack(np.meshgrid(xs, ys), axis=-1).reshape(-1, 2)
    gap_m = np.full(len(points), np.inf)
    for a, b in zip(room.segments.a, room.segments.b, strict=True):
        edge = b - a
        along = np.clip((points - a) @ edge / (edge @ edge), 0.0, 1.0)
        gap_m = np.minimum(gap_m, np.linalg.norm(points - a - along[:, None] * edge, axis=1))
    for centre, radius_m in zip(room.circles.centre, room.circles.radius_m, strict=True):
        gap_m = np.minimum(gap_m, np.maximum(0.0, np.linalg.norm(points - centre, axis=1) - radius_m))
    shade = 1.0 - 0.5 * np.exp(-gap_m / SHADOW_REACH_M)
    return stretched(shade.reshape(len(ys), len(xs)), shape)


@dataclass(frozen=True, slots=True)
class Panorama:
    """Full turn, one column per ``2π / width``; the last row touches the horizon. ``hills`` is 0 where sky shows."""

    sky: Packed
    hills: Packed


def panorama_of(seed: int, width: int, height: int) -> Panorama:
    """A clear day: gradient, drifting clouds, and two ranges of hills."""
    rng = np.random.default_rng([seed, 3])
    rise = np.linspace(1.0, 0.0, height)[:, None, None]
    sky = np.array((236.0, 224.0, 208.0)) * (1 - rise) + np.array((208.0, 150.0, 92.0)) * rise
    sky = np.broadcast_to(sky, (height, width, 3)) + _clouds(rng, height, width)[..., None] * (
        np.array((250.0, 250.0, 250.0)) - sky
    )
    hills = np.zeros((height, width), dtype=np.uint32)
    ranges = (((188, 170, 150), 0.135, 3), ((128, 142, 118), 0.085, 5))
    for colour, reach, waves in ranges:
        ridge = _ridge(rng, width, waves) * reach * height * 2
        below = np.arange(height)[:, None] > height - ridge
        tone = 1.0 - 0.10 * (np.arange(height)[:, None] - (height - ridge)) / height * 4
        hills[below] = packed(tone[..., None] * np.array(colour, dtype=np.float64))[below]
    return Panorama(packed(np.asarray(sky)), hills)


def _clouds(rng: np.random.Generator, height: int, width: int) -> Floats:
    """Opacity 0–0.9: noise in octaves above a threshold, fading towards horizon and zenith."""
    total = np.zeros((height, width))
    for octave, weight in ((1, 0.55), (2, 0.27), (4, 0.13), (8, 0.05)):
        total += weight * smooth_noise(rng, (height, width), (6 * octave, 18 * octave))
    height_above = np.linspace(1.0, 0.0, height)[:, None]
    window = np.clip(height_above * 5.0, 0.0, 1.0)
    return np.asarray(np.clip((total - 0.47) * 4.5, 0.0, 0.9) * window)


def _ridge(rng: np.random.Generator, width: int, waves: int) -> Floats:
    """A closed skyline 0.3–1 around the full turn."""
    turn = np.linspace(0.0, 2 * math.pi, width, endpoint=False)
    line = sum(np.sin(turn * waves * k + rng.uniform(0, 2 * math.pi)) / k for k in (1, 2, 3, 5))
    return np.asarray(0.62 + 0.38 * np.asarray(line) / 1.9)
