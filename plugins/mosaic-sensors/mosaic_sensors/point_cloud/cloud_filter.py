"""Filters a point cloud: a crop box, a range, one point per voxel, a most. Vectorized; the points keep their order."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from mosaic_sensors.point_cloud.cloud import Floats, PointCloud
from mosaic_sensors.point_cloud.params import PointCloudParams

_KEY_BITS = 21
"""Voxels per axis that a 63-bit key tells apart: two million."""
_MIX = np.uint64(0x9E3779B97F4A7C15)
"""2^64 divided by the golden ratio: spreads neighbouring keys (Fibonacci hashing, Knuth 6.4)."""


def filtered(cloud: PointCloud, by: PointCloudParams) -> PointCloud:
    """The points that stay, in their order."""
    mask = _inside(cloud.xyz, by)
    if mask is not None and not mask.all():
        cloud = cloud.chosen(mask)
    if by.voxel_size_m > 0 and len(cloud):
        cloud = cloud.chosen(one_per_voxel(cloud.xyz, by.voxel_size_m))
    return sampled(cloud, by.max_points)


def _inside(xyz: Floats, by: PointCloudParams) -> NDArray[np.bool_] | None:
    conditions: list[Any] = []
    if by.crop_min_m is not None:
        conditions.append((xyz >= np.asarray(by.crop_min_m)).all(axis=1))
    if by.crop_max_m is not None:
        conditions.append((xyz <= np.asarray(by.crop_max_m)).all(axis=1))
    if by.min_range_m > 0 or by.max_range_m is not None:
        squared = np.einsum("ij,ij->i", xyz, xyz, dtype=np.float64)
        conditions.append(squared >= by.min_range_m**2)
        if by.max_range_m is not None:
            conditions.append(squared <= by.max_range_m**2)
    return np.asarray(np.logical_and.reduce(conditions)) if conditions else None


def sampled(cloud: PointCloud, count: int) -> PointCloud:
    """At most ``count`` points, evenly taken along the cloud's order."""
    if len(cloud) <= count:
        return cloud
    return cloud.chosen((np.arange(count, dtype=np.int64) * len(cloud) // max(count, 1)).astype(np.intp))


def one_per_voxel(xyz: Floats, size_m: float) -> NDArray[np.intp]:
    """Indices, ascending, of one measured point in each occupied cube of this edge.

    A hash table filled by array assignment: those who lose their slot to another voxel try again with another hash.
    Linear in the points, and their order stays (neighbours in it are near each other, which compresses well).
    """
    keys = _voxel_keys(xyz, size_m)
    left = np.arange(len(keys), dtype=np.int32)
    found: list[NDArray[np.int32]] = []
    turn = 0
    while len(left):
        bits = max(6, int(2 * len(left) - 1).bit_length())
        mixed = (keys[left] + np.uint64(turn)) * _MIX
        slots = ((mixed ^ (mixed >> np.uint64(29))) * _MIX >> np.uint64(64 - bits)).astype(np.intp)
        table = np.empty(1 << bits, dtype=np.int32)
        table[slots] = left
        winners = table[slots]
        found.append(left[winners == left])
        left = left[keys[winners] != keys[left]]
        turn += 1
    kept = np.concatenate(found) if found else np.empty(0, dtype=np.int32)
    kept.sort()
    return kept.astype(np.intp)


def _voxel_keys(xyz: Floats, size_m: float) -> NDArray[np.uint64]:
    low = xyz.min(axis=0).astype(np.float64) if len(xyz) else np.zeros(3)
    # On the grid of the frame, not of this cloud: what stands still keeps its voxel from cloud to cloud.
    cells = np.floor(xyz / size_m) - np.floor(low / size_m)
    # Farther than two million voxels from the nearest corner, all is one voxel.
    whole: NDArray[Any] = np.minimum(cells, (1 << _KEY_BITS) - 1).astype(np.uint64)
    x, y, z = whole[:, 0], whole[:, 1], whole[:, 2]
    return np.asarray(x | y << np.uint64(_KEY_BITS) | z << np.uint64(2 * _KEY_BITS))
