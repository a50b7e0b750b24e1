"""Draws the textures of surfaces: procedural pictures made once, packed one pixel per ``uint32`` (0x00RRGGBB), with
mipmaps.

All of it is drawn by numpy from a seed; the package ships no image file.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from mosaic_sim.room import Floats, Material

Packed: TypeAlias = NDArray[np.uint32]

TILE = 256
"""Edge of a wall texture in texels: at 1 m from a 640-pixel camera about two screen pixels per texel."""
LEVELS = 6


def packed(bgr: Floats) -> Packed:
    """(…, 3) floats 0–255 in BGR order → one ``uint32`` per pixel, whose little-endian bytes are B, G, R, 0."""
    levels = np.clip(bgr, 0, 255).astype(np.uint32)
    return np.asarray(levels[..., 0] | levels[..., 1] << 8 | levels[..., 2] << 16, dtype=np.uint32)


def halved(bgr: Floats) -> Floats:
    """The next mipmap: each texel the mean of four."""
    height, width = bgr.shape[0] // 2, bgr.shape[1] // 2
    four = bgr[: height * 2, : width * 2].reshape(height, 2, width, 2, 3)
    return np.asarray(four.mean(axis=(1, 3)))


def smooth_noise(rng: np.random.Generator, shape: tuple[int, int], cells: tuple[int, int]) -> Floats:
    """Noise 0–1 whose blobs are ``shape / cells`` pixels large; wraps around horizontally."""
    grid = rng.random(cells)
    return stretched(np.concatenate([grid, grid[:, :1]], axis=1), shape)


def stretched(grid: Floats, shape: tuple[int, int]) -> Floats:
    """``grid`` enlarged to ``shape`` with bilinear interpolation."""
    rows = np.linspace(0, grid.shape[0] - 1, shape[0])
    columns = np.linspace(0, grid.shape[1] - 1, shape[1])
    top, left = np.minimum(rows.astype(int), grid.shape[0] - 2), np.minimum(columns.astype(int), grid.shape[1] - 2)
    down, right = (rows - top)[:, None], columns - left
    upper = grid[top][:, left] * (1 - right) + grid[top][:, left + 1] * right
    lower = grid[top + 1][:, left] * (1 - right) + grid[top + 1][:, left + 1] * right
    return np.asarray(upper * (1 - down) + lower * down)


@dataclass(frozen=True, slots=True)
class Atlas:
    """Every material at every mip level in one flat array: texel = ``texels[start[level] + …]``."""

    texels: Packed
    start: NDArray[np.intp]
    edge: NDArray[np.intp]


def surfaces(seed: int) -> Atlas:
    """The atlas of all materials; row 0 of each texture is the top of the surface."""
    rng = np.random.default_rng([seed, 1])
    images = [_PAINTERS[material](rng) for material in Material]
    parts: list[Packed] = []
    starts: list[int] = []
    for _ in range(LEVELS):
        starts.append(sum(part.size for part in parts))
        parts.append(np.concatenate([packed(image).ravel() for image in images]))
        images = [halved(image) for image in images]
    edges = TILE >> np.arange(LEVELS)
    return Atlas(np.concatenate(parts), np.asarray(starts, dtype=np.intp), edges.astype(np.intp))


def _plain(rng: np.random.Generator, bgr: tuple[int, int, int], grain: float) -> Floats:
    image = np.empty((TILE, TILE, 3))
    image[:] = bgr
    speckle = smooth_noise(rng, (TILE, TILE), (64, 64)) + smooth_noise(rng, (TILE, TILE), (12, 12)) - 1.0
    return np.asarray(image * (1.0 + grain * speckle[..., None]))


def _bricks(rng: np.random.Generator, bgr: tuple[int, int, int]) -> Floats:
    """Courses of bricks with light joints, a dark plinth below and a coping stone on top."""
    image = _plain(rng, bgr, 0.10)
    courses, per_course = 10, 4
    height, width = TILE / courses, TILE / per_course
    rows, columns = np.mgrid[0:TILE, 0:TILE]
    course = (rows // height).astype(int)
    shifted = (columns + (course % 2) * width / 2) % TILE
    brick = (shifted // width).astype(int)
    image *= (0.88 + 0.24 * rng.random((courses, per_course)))[course.clip(0, courses - 1), brick][..., None]
    joint = ((rows % height) < 2.5) | ((shifted % width) < 2.5)
    image[joint] = image[joint] * 0.35 + np.array((150, 158, 165)) * 0.65
    image[: TILE // 14] = _plain(rng, (196, 204, 210), 0.05)[: TILE // 14]
    image[TILE // 14 : TILE // 14 + 4] *= 0.55
    image[-TILE // 10 :] = _plain(rng, (92, 92, 96), 0.08)[-TILE // 10 :]
    return image


def _plaster(rng: np.random.Generator, bgr: tuple[int, int, int]) -> Floats:
    image = _plain(rng, bgr, 0.08)
    image[: TILE // 14] = (206, 210, 214)
    image[-TILE // 8 :] *= 0.62
    image[:, :3] *= 0.72
    return image


def _planks(rng: np.random.Generator, bgr: tuple[int, int, int]) -> Floats:
    """The face of a crate: boards in a frame with a brace across."""
    grain = 0.75 + 0.5 * stretched(rng.random((40, 5)), (TILE, TILE))
    image = _plain(rng, bgr, 0.08) * grain[..., None]
    image[np.arange(TILE) % 43 < 3] *= 0.45
    rows, columns = np.mgrid[0:TILE, 0:TILE]
    border = np.minimum(np.minimum(rows, columns), np.minimum(TILE - 1 - rows, TILE - 1 - columns))
    brace = np.abs(rows - columns) < 18
    frame = (border < 26) | brace
    image[frame] = (np.array(bgr) * 1.16) * grain[frame][:, None]
    edge = (np.abs(border - 26) < 2) | ((np.abs(np.abs(rows - columns) - 18) < 2) & (border > 26)) | (border < 3)
    image[edge] *= 0.5
    return image


def _hoops(rng: np.random.Generator, bgr: tuple[int, int, int]) -> Floats:
    """A barrel: paint, two ribs and a white band with a mark that shows it turning by."""
    image = _plain(rng, bgr, 0.06)
    rows = np.arange(TILE)
    for centre in (TILE // 3, 2 * TILE // 3):
        image[np.abs(rows - centre) < 7] *= 1.22
        image[(rows - centre > 6) & (rows - centre < 12)] *= 0.6
    image[TILE // 2 - 22 : TILE // 2 + 22, : TILE // 2] = (225, 228, 230)
    image[:9] = (70, 70, 74)
    image[-9:] *= 0.5
    return image


def _stripes(rng: np.random.Generator) -> Floats:
    """A traffic post: orange with two white bands on a black foot."""
    image = _plain(rng, (38, 110, 240), 0.05)
    image[TILE // 6 : TILE // 3] = (235, 238, 240)
    image[TILE // 2 : 2 * TILE // 3] = (235, 238, 240)
    image[-TILE // 9 :] = (52, 50, 50)
    return image


_PAINTERS = {
    Material.NORTH: lambda rng: _bricks(rng, (168, 128, 84)),
    Material.EAST: lambda rng: _bricks(rng, (78, 96, 184)),
    Material.SOUTH: lambda rng: _bricks(rng, (96, 150, 98)),
    Material.WEST: lambda rng: _bricks(rng, (84, 158, 200)),
    Material.DIVIDER: lambda rng: _plaster(rng, (186, 178, 172)),
    Material.PILLAR: lambda rng: _plaster(rng, (150, 156, 160)),
    Material.CRATE: lambda rng: _planks(rng, (84, 136, 178)),
    Material.BARREL_RED: lambda rng: _hoops(rng, (52, 48, 198)),
    Material.BARREL_BLUE: lambda rng: _hoops(rng, (186, 112, 40)),
    Material.CONE: _stripes,
}
