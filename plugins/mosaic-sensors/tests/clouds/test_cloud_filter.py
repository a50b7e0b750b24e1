"""Crop, range, voxels and a most: what stays is measured points, in their order."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from mosaic_sensors.point_cloud.cloud import Floats, cloud_of
from mosaic_sensors.point_cloud.cloud_filter import filtered, one_per_voxel, sampled
from mosaic_sensors.point_cloud.params import PointCloudParams

points = arrays.arrays(
    np.float32, st.tuples(st.integers(0, 60), st.just(3)), elements=st.floats(-50, 50, width=32, allow_nan=False)
)


@given(points, st.sampled_from([0.05, 0.5, 3.0]))
def test_every_occupied_voxel_keeps_one_of_its_own_points(xyz: Floats, size_m: float) -> None:
    kept = one_per_voxel(xyz, size_m)
    cells = [tuple(cell) for cell in np.floor(xyz / size_m).astype(int).tolist()]
    assert sorted(cells[index] for index in kept) == sorted(set(cells))
    assert kept.tolist() == sorted(set(kept.tolist()))


def test_many_points_of_few_voxels_and_all_of_different_ones() -> None:
    rng = np.random.default_rng(1)
    crowd = rng.uniform(0, 1, (50_000, 3)).astype(np.float32)
    assert len(one_per_voxel(crowd, 0.5)) == 8
    grid = np.stack(np.meshgrid(*[np.arange(30)] * 3), axis=-1).reshape(-1, 3) + 0.5
    assert len(one_per_voxel(grid, 1.0)) == 27_000


def test_what_stands_still_keeps_its_voxel_when_the_cloud_around_it_grows() -> None:
    still = np.array([[0.1, 0.1, 0.1], [0.45, 0.1, 0.1]])
    more = np.vstack([still, [[-7.3, -2.2, -0.1]]])
    assert len(one_per_voxel(still, 0.5)) == 1
    assert len(one_per_voxel(more, 0.5)) == 2


def test_an_extent_beyond_the_keys_is_still_thinned() -> None:
    assert len(one_per_voxel(np.array([[0.0, 0, 0], [1e9, 0, 0], [2e9, 0, 0]]), 0.01)) == 2


def test_the_box_and_the_range_leave_out_what_is_beyond() -> None:
    cloud = cloud_of([[0.1, 0, 0], [1, 0, 0], [2, 2, 0], [9, 0, 0]])
    assert filtered(cloud, PointCloudParams(min_range_m=0.5, max_range_m=5)).xyz[:, 0].tolist() == [1, 2]
    box = PointCloudParams(crop_min_m=(-1, -1, -1), crop_max_m=(1.5, 1, 1))
    assert filtered(cloud, box).xyz[:, 0].tolist() == pytest.approx([0.1, 1])
    assert filtered(cloud, PointCloudParams(min_range_m=50)).xyz.shape == (0, 3)
    assert filtered(cloud, PointCloudParams()) is cloud


@given(st.integers(0, 500), st.integers(0, 300))
def test_a_sample_has_the_asked_size_and_spans_the_cloud(have: int, count: int) -> None:
    cloud = sampled(cloud_of(np.arange(have * 3).reshape(-1, 3)), count)
    assert len(cloud) == min(have, count)
    assert len(set(cloud.xyz[:, 0].tolist())) == len(cloud)
    if 0 < count < have:
        assert cloud.xyz[-1, 0] >= (have - 1) * 3 * (1 - 2 / count)


def test_all_columns_go_with_their_points() -> None:
    cloud = cloud_of(np.full((4, 3), [[0], [0], [1], [2]]), intensity=[5, 6, 7, 8], rgb=np.eye(4, 3, dtype=np.uint8))
    some = filtered(cloud, PointCloudParams(voxel_size_m=0.5))
    assert len(some) == 3
    assert some.intensity is not None
    assert some.intensity[1:].tolist() == [7, 8]
    assert some.rgb is not None
    assert some.rgb[1].tolist() == [0, 0, 1]
