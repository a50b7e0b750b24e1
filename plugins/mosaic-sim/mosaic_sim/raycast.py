"""Rays against the room, all at once: what the laser measures and the camera sees. Pure numpy."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mosaic_sim.room import Circles, Floats, Room, Segments

_TOO_NEAR = 1e-9


@dataclass(frozen=True, slots=True)
class Hits:
    """The surfaces that rays hit, an entry per ray. ``distance`` counts in lengths of the ray's direction vector;
    ``inf`` where nothing is hit.

    ``u`` is the place along the surface in texture repeats, ``facing`` the cosine between ray and surface normal.
    """

    distance: Floats
    material: NDArray[np.intp]
    u: Floats
    facing: Floats
    normal: Floats


def cast(room: Room, origin: tuple[float, float], directions: Floats, tall: bool | None = None) -> Hits:
    """The nearest surface along each ray from ``origin``.

    ``directions`` has shape (n, 2); with unit vectors distances are metres. ``tall`` restricts the search to tall
    (``True``) or low (``False``) things.
    """
    hits = _no_hits(len(directions))
    segments, circles = room.segments, room.circles
    lines = np.arange(len(segments.material)) if tall is None else np.flatnonzero(segments.is_tall == tall)
    rounds = np.arange(len(circles.material)) if tall is None else np.flatnonzero(circles.is_tall == tall)
    if lines.size:
        _merge(hits, _against_segments(segments, lines, np.asarray(origin), directions))
    if rounds.size:
        _merge(hits, _against_circles(circles, rounds, np.asarray(origin), directions))
    return hits


def _no_hits(count: int) -> Hits:
    return Hits(
        distance=np.full(count, np.inf),
        material=np.zeros(count, dtype=np.intp),
        u=np.zeros(count),
        facing=np.zeros(count),
        normal=np.zeros((count, 2)),
    )


def _merge(nearest: Hits, other: Hits) -> None:
    """Take over, in place, whatever ``other`` hits earlier."""
    nearer = other.distance < nearest.distance
    for name in ("distance", "material", "u", "facing", "normal"):
        getattr(nearest, name)[nearer] = getattr(other, name)[nearer]


def _against_segments(segments: Segments, chosen: NDArray[np.intp], origin: Floats, directions: Floats) -> Hits:
    """Solve origin + t·d = a + s·e for every pair of ray and segment."""
    edge = segments.b[chosen] - segments.a[chosen]
    to_a = segments.a[chosen] - origin
    dx, dy = directions[:, 0, None], directions[:, 1, None]
    cross = dx * edge[:, 1] - dy * edge[:, 0]
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        t = (to_a[:, 0] * edge[:, 1] - to_a[:, 1] * edge[:, 0]) / cross
        s = (to_a[:, 0] * dy - to_a[:, 1] * dx) / cross
        t[~((t > _TOO_NEAR) & (s >= 0.0) & (s <= 1.0))] = np.inf
    best = np.argmin(t, axis=1)
    ray = np.arange(len(directions))
    normal = np.stack([edge[:, 1], -edge[:, 0]], axis=1) / np.linalg.norm(edge, axis=1)[:, None]
    along = np.nan_to_num(s[ray, best]) * segments.repeats[chosen[best]]
    return _hits(t[ray, best], segments.material[chosen[best]], along, normal[best], directions)


def _against_circles(circles: Circles, chosen: NDArray[np.intp], origin: Floats, directions: Floats) -> Hits:
    """Solve |origin + t·d − c| = r for every pair of ray and circle; the nearer root counts."""
    centre, radius_m = circles.centre[chosen], circles.radius_m[chosen]
    from_centre = origin - centre
    a = np.sum(directions**2, axis=1)[:, None]
    half_b = directions @ from_centre.T
    c = np.sum(from_centre**2, axis=1) - radius_m**2
    root = half_b**2 - a * c
    with np.errstate(invalid="ignore"):
        t = (-half_b - np.sqrt(root)) / a
        t[~(t > _TOO_NEAR)] = np.inf
    best = np.argmin(t, axis=1)
    distance = t[np.arange(len(directions)), best]
    reach = np.where(np.isfinite(distance), distance, 0.0)[:, None] * directions
    normal = (from_centre[best] + reach) / radius_m[best][:, None]
    # Two repeats around: the seam of the texture never shows twice from one side.
    along = np.arctan2(normal[:, 1], normal[:, 0]) / np.pi + 1.0
    return _hits(distance, circles.material[chosen[best]], along, normal, directions)


def _hits(distance: Floats, material: NDArray[np.intp], u: Floats, normal: Floats, directions: Floats) -> Hits:
    length = np.linalg.norm(directions, axis=1)
    facing = np.abs(np.sum(normal * directions, axis=1)) / length
    # A wall has two sides: its normal looks towards whoever looks at it.
    side = np.where(np.sum(normal * directions, axis=1) > 0.0, -1.0, 1.0)
    return Hits(distance, material, u, facing, normal * side[:, None])
