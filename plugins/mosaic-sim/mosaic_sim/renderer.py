"""The first-person picture: sky, floor, tall things, low things, painted back to front with numpy.

One ray per column finds the surfaces; texels are gathered as packed ``uint32`` and shaded in fixed point, which keeps
640×480 at a few milliseconds. Buffers are reused: one renderer belongs to one thread.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from mosaic_core.contract.media import Image
from mosaic_sim.landscape import TEXELS_PER_M, floor_in_steps, panorama_of
from mosaic_sim.raycast import Hits, cast
from mosaic_sim.room import Floats, Room
from mosaic_sim.textures import LEVELS, TILE, Packed, surfaces

CAMERA_HEIGHT_M = 0.42
"""Below the lowest obstacle's top, so that no top face is ever seen and the nearer thing always hides the farther."""
NEAR_M = 0.05
SUN = np.array((-0.55, -0.83))
"""Direction the light comes from, over the south-west: opposite walls differ, corners read as corners."""
CLOUD_DRIFT_RADPS = 0.006
_RED_BLUE, _GREEN = np.uint32(0x00FF00FF), np.uint32(0x0000FF00)


class Renderer:
    """Draws ``room`` as a camera of ``width`` × ``height`` pixels and horizontal field of view ``fov_deg`` sees it."""

    def __init__(self, room: Room, *, width: int, height: int, fov_deg: float = 75.0, seed: int = 1) -> None:
        self._room = room
        self._width, self._height = width, height
        self._focal_px = width / 2 / math.tan(math.radians(fov_deg) / 2)
        self._slopes = (width / 2 - np.arange(width) - 0.5) / self._focal_px
        """Per column: how far left of straight ahead, in lengths of the viewing distance."""
        self._bearings_rad = np.arctan(self._slopes)
        self._horizon = height // 2
        self._seed = seed
        self._rows = np.arange(height, dtype=np.float32)[:, None]
        self._picture = np.empty((height, width), dtype=np.uint32)
        self._shade = np.empty((height, width), dtype=np.uint32)
        self._is_prepared = False

    def prepared(self) -> Iterator[None]:
        """Draw the scenery once, which takes half a second of a processor, in steps: whoever shall stop leaves between
        two of them. What is not drawn yet :meth:`render` draws."""
        if self._is_prepared:
            return
        self._atlas = surfaces(self._seed)
        yield
        self._floor = yield from floor_in_steps(self._room, self._seed)
        self._panorama = panorama_of(self._seed, round(2 * math.pi * self._focal_px), self._horizon)
        self._floor_depths()
        self._is_prepared = True

    def render(self, x_m: float, y_m: float, yaw_rad: float, time_s: float) -> Image:
        """The picture from this place, looking along ``yaw_rad``; ``time_s`` moves the clouds. A new BGR array."""
        for _ in self.prepared():
            pass
        forward = np.array((math.cos(yaw_rad), math.sin(yaw_rad)))
        left = np.array((-forward[1], forward[0]))
        directions = forward + self._slopes[:, None] * left
        self._paint_sky(yaw_rad, time_s)
        self._paint_floor(x_m, y_m, directions)
        tall = cast(self._room, (x_m, y_m), directions, tall=True)
        low = cast(self._room, (x_m, y_m), directions, tall=False)
        self._paint_things(tall, self._room.wall_height_m, np.arange(self._width))
        self._paint_things(low, self._room.low_height_m, np.flatnonzero(low.distance < tall.distance))
        return self._shaded()

    def _floor_depths(self) -> None:
        """What depends on the picture's row alone: how far the floor is there, its mip level and its shade."""
        below = np.arange(self._horizon, self._height) - self._height / 2 + 0.5
        depth_m = CAMERA_HEIGHT_M * self._focal_px / np.maximum(below, 0.5)
        # The texel's footprint is longest in the viewing direction; between both, joints stay crisp without flicker.
        footprint = TEXELS_PER_M * depth_m / self._focal_px * np.sqrt(np.maximum(1.0, depth_m / CAMERA_HEIGHT_M))
        level = np.clip(np.log2(np.maximum(footprint, 1.0)), 0, LEVELS - 1).astype(np.intp)
        self._depth_m = depth_m.astype(np.float32)[:, None]
        self._floor_scale = (TEXELS_PER_M / 2.0**level).astype(np.float32)[:, None]
        self._floor_start = self._floor.start[level].astype(np.int32)[:, None]
        self._floor_width = self._floor.width[level].astype(np.int32)[:, None]
        self._floor_height = self._floor.height[level].astype(np.int32)[:, None]
        self._floor_shade = _fixed(_dimmed(depth_m))[:, None]

    def _paint_sky(self, yaw_rad: float, time_s: float) -> None:
        width = self._panorama.sky.shape[1]
        turns = -(yaw_rad + self._bearings_rad) / (2 * math.pi)
        still = (np.mod(turns, 1.0) * width).astype(np.intp) % width
        drifting = (np.mod(turns + time_s * CLOUD_DRIFT_RADPS / (2 * math.pi), 1.0) * width).astype(np.intp) % width
        sky, hills = self._panorama.sky[:, drifting], self._panorama.hills[:, still]
        self._picture[: self._horizon] = np.where(hills > 0, hills, sky)
        self._shade[: self._horizon] = 256

    def _paint_floor(self, x_m: float, y_m: float, directions: Floats) -> None:
        column = self._texel(x_m + self._room.half_x_m, directions[:, 0], self._floor_width)
        row = self._texel(y_m + self._room.half_y_m, directions[:, 1], self._floor_height)
        row *= self._floor_width
        row += column
        row += self._floor_start
        self._picture[self._horizon :] = self._floor.texels.take(row, mode="clip")
        self._shade[self._horizon :] = self._floor_shade

    def _texel(self, origin_m: float, direction: Floats, size: NDArray[np.int32]) -> NDArray[np.int32]:
        """Texel coordinate along one axis for each floor pixel, kept inside the picture of the floor."""
        place = self._depth_m * direction.astype(np.float32)
        place += np.float32(origin_m)
        place *= self._floor_scale
        texel: NDArray[np.int32] = place.astype(np.int32)
        np.clip(texel, 0, size - 1, out=texel)
        return texel

    def _paint_things(self, hits: Hits, height_m: float, columns: NDArray[np.intp]) -> None:
        """Upright surfaces, one per column, over what is already painted."""
        columns = columns[np.isfinite(hits.distance[columns])]
        if not columns.size:
            return
        depth_m = np.maximum(hits.distance[columns], NEAR_M)
        px_per_m = self._focal_px / depth_m
        top = self._height / 2 - (height_m - CAMERA_HEIGHT_M) * px_per_m
        bottom = self._height / 2 + CAMERA_HEIGHT_M * px_per_m
        first, last = max(0, math.floor(top.min())), min(self._height, math.ceil(bottom.max()))
        rows = self._rows[first:last] + np.float32(0.5)
        v = (rows - top.astype(np.float32)) * (1.0 / (bottom - top)).astype(np.float32)
        is_inside = (v >= 0.0) & (v < 1.0)
        texels = self._texels_of(hits, columns, v, height_m * px_per_m)
        where = (slice(first, last), columns) if columns.size < self._width else (slice(first, last), slice(None))
        self._picture[where] = np.where(is_inside, texels, self._picture[where])
        shade = _fixed(_dimmed(depth_m) * _lit(hits.normal[columns]))
        self._shade[where] = np.where(is_inside, shade, self._shade[where])

    def _texels_of(self, hits: Hits, columns: NDArray[np.intp], v: NDArray[np.float32], height_px: Floats) -> Packed:
        level = np.clip(np.log2(np.maximum(TILE / height_px, 1.0)), 0, LEVELS - 1).astype(np.intp)
        edge = self._atlas.edge[level]
        u = np.minimum((np.mod(hits.u[columns], 1.0) * edge).astype(np.intp), edge - 1)
        start = self._atlas.start[level] + hits.material[columns] * edge * edge + u
        row = (v * edge.astype(np.float32)).astype(np.int32)
        np.clip(row, 0, (edge - 1).astype(np.int32), out=row)
        row *= edge.astype(np.int32)
        row += start.astype(np.int32)
        return np.asarray(self._atlas.texels.take(row, mode="clip"))

    def _shaded(self) -> Image:
        """Multiply by the shade in 8.8 fixed point, red and blue together, and drop the unused fourth byte."""
        red_blue = self._picture & _RED_BLUE
        red_blue *= self._shade
        red_blue >>= np.uint32(8)
        red_blue &= _RED_BLUE
        green = self._picture & _GREEN
        green *= self._shade
        green >>= np.uint32(8)
        green &= _GREEN
        red_blue |= green
        return np.ascontiguousarray(red_blue.view(np.uint8).reshape(self._height, self._width, 4)[..., :3])


def _dimmed(depth_m: Floats) -> Floats:
    """Farther is darker: full brightness up close, about half across the yard."""
    return np.asarray(1.0 / (1.0 + np.maximum(depth_m - 0.5, 0.0) * 0.075))


def _lit(normal: Floats) -> Floats:
    """Brightness of an upright surface by how much it faces the sun."""
    return np.asarray(0.80 + 0.20 * (normal @ SUN))


def _fixed(shade: Floats) -> NDArray[np.uint32]:
    return np.clip(shade * 256.0, 0, 256).astype(np.uint32)
