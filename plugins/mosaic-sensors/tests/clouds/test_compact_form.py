"""The compact form: what comes back is within half a step, whatever the cloud; hostile bytes cost nothing."""

from __future__ import annotations

import struct
import zlib
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from mosaic_core.words.errors import WireError
from mosaic_sensors.point_cloud import PointCloud, cloud_of, decoded
from mosaic_sensors.point_cloud.compact_form import WIDE, encoded

coordinates = st.floats(-1e5, 1e5, allow_nan=False) | st.floats(-2, 2, allow_nan=False)


def in_order(xyz: Any) -> Any:
    """Rows sorted: the form may change their order."""
    rows = np.asarray(xyz, dtype=np.float64)
    return rows[np.lexsort(rows.T)]


@given(
    arrays.arrays(np.float64, st.tuples(st.integers(0, 40), st.just(3)), elements=coordinates),
    st.sampled_from([0.001, 0.01, 0.25]),
    st.booleans(),
)
def test_every_coordinate_comes_back_within_half_a_step(xyz: Any, resolution_m: float, is_deflated: bool) -> None:
    tagged = cloud_of(xyz, intensity=np.arange(len(xyz), dtype=np.uint8))
    form = encoded(tagged, resolution_m)
    back = decoded(form.deflated() if is_deflated else form.plain())
    assert len(back) == len(xyz)
    assert back.intensity is not None
    assert sorted(back.intensity.tolist()) == list(range(len(xyz)))
    error = np.abs(back.xyz - xyz[np.rint(back.intensity).astype(int)])
    assert (error <= resolution_m / 2 + 1e-9).all()


def test_two_million_points_and_none() -> None:
    rng = np.random.default_rng(0)
    xyz = (np.cumsum(rng.normal(0, 0.02, (2_000_000, 3)), axis=0) % 60).astype(np.float32)
    form = encoded(cloud_of(xyz))
    back = decoded(form.deflated())
    assert len(back) == 2_000_000
    assert np.abs(in_order(back.xyz)[:, 2] - np.sort(xyz[:, 2])).max() <= 0.005 + 1e-6
    empty = decoded(encoded(cloud_of([])).deflated())
    assert (len(empty), empty.intensity, empty.rgb) == (0, None, None)


def test_name_time_intensity_and_colour_travel_along() -> None:
    cloud = cloud_of(
        [[0.0, 0, 0], [0.01, 0, 0], [0.02, 0, 0]],
        intensity=[-5.0, 0.0, 250.0],
        rgb=[[0, 1, 255], [10, 0, 3], [255, 255, 0]],
        frame_id="base_lïnk",
        captured_at_s=12.345678,
    )
    back = decoded(encoded(cloud).plain())
    assert (back.frame_id, back.captured_at_s) == ("base_lïnk", 12.345678)
    assert back.intensity is not None
    assert back.intensity.tolist() == pytest.approx([-5.0, 0.0, 250.0], abs=0.51)
    assert cloud.rgb is not None
    assert back.rgb is not None
    assert back.rgb.tolist() == cloud.rgb.tolist()


@pytest.mark.parametrize(
    ("values", "back"),
    [
        (np.array([7, 255, 0], np.uint8), [7, 255, 0]),
        (np.array([3.0, 3.0, 3.0]), [3, 3, 3]),
        (np.array([-4.5, -4.5, -4.5]), [-4.5, -4.5, -4.5]),
        (np.array([np.nan, 0.0, 10.0]), [0, 0, 10]),
        (np.array([np.inf, -10.0, 245.0]), [0, -10, 245]),
        (np.array([-np.inf, -10.0, 245.0]), [0, -10, 245]),
        (np.array([-1e300, 0.0, 1e300]), [-3e38, 0, 3e38]),
        (np.array([True, False, True]), [1, 0, 1]),
    ],
)
def test_bytes_stay_bytes_and_odd_intensities_are_taken(values: Any, back: list[float]) -> None:
    read = decoded(encoded(cloud_of(np.eye(3), intensity=values)).plain()).intensity
    assert read is not None
    level = (max(back) - min(back)) / 255
    assert sorted(read.tolist()) == pytest.approx(sorted(back), rel=1e-6, abs=0.501 * level)


@given(arrays.arrays(np.float64, st.integers(1, 40), elements=st.floats(-1e6, 1e6, width=32)))
def test_an_intensity_comes_back_within_half_a_level_and_its_ends_as_they_are(values: Any) -> None:
    cloud = cloud_of(np.arange(3 * len(values)).reshape(-1, 3), intensity=values)
    read = decoded(encoded(cloud, 1.0).plain()).intensity
    assert read is not None
    level, rounding = (values.max() - values.min()) / 255, 1e-6 * np.abs(values).max() + 1e-37
    assert np.abs(read - values).max() <= level / 2 + rounding
    assert (read.min(), read.max()) == pytest.approx((values.min(), values.max()), abs=rounding)


def test_a_wide_cloud_takes_four_bytes_and_what_is_beyond_them_is_left_out() -> None:
    narrow, wide = encoded(cloud_of([[0, 0, 0], [655.0, 0, 0]])), encoded(cloud_of([[0, 0, 0], [656.0, 0, 0]]))
    assert (narrow.header[4] & WIDE, wide.header[4] & WIDE) == (0, WIDE)
    assert len(wide.body) == 2 * len(narrow.body) == 2 * 12
    back = decoded(encoded(cloud_of(np.array([[1e12, 0, 0], [-2e7, 3, 2e7]]))).plain())
    assert back.xyz.tolist() == [[-2e7, 3, 2e7]]


def test_a_scanners_order_stays_and_a_random_one_is_sorted_so_that_it_deflates() -> None:
    angles = np.linspace(0, 6.2, 20_000)
    scan = np.stack([10 * np.cos(angles), 10 * np.sin(angles), np.zeros_like(angles)], axis=1)
    shuffled = np.random.default_rng(2).permutation(scan)
    kept = decoded(encoded(cloud_of(scan)).plain()).xyz
    assert np.abs(kept - scan).max() <= 0.005 + 1e-9
    sizes = [len(encoded(cloud_of(xyz)).deflated()) for xyz in (scan, shuffled)]
    assert sizes[1] < 3 * 20_000
    assert sizes[0] < sizes[1]


def test_a_long_name_is_cut_at_a_whole_character() -> None:
    assert decoded(encoded(cloud_of([], frame_id="ä" * 200)).plain()).frame_id == "ä" * 127


GOOD = encoded(cloud_of(np.arange(30).reshape(-1, 3) / 7, intensity=np.arange(10), frame_id="map"))


def with_header(position: int, layout: str, value: Any) -> bytes:
    data = bytearray(GOOD.plain())
    struct.pack_into(layout, data, position, value)
    return bytes(data)


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"MPC",
        GOOD.plain()[:60],
        GOOD.plain()[:61],
        GOOD.plain()[:-1],
        GOOD.plain() + b"x",
        GOOD.deflated()[:-20],
        GOOD.deflated()[:63] + b"not deflated",
        with_header(0, "4s", b"MPC9"),
        with_header(8, "!I", 4_000_000_000),
        with_header(8, "!I", 11),
        with_header(20, "!d", 0.0),
        with_header(20, "!d", float("nan")),
        with_header(28, "!d", float("inf")),
    ],
)
def test_malformed_clouds_are_refused(data: bytes) -> None:
    with pytest.raises(WireError):
        decoded(data)


def test_a_body_that_inflates_beyond_its_count_is_not_inflated() -> None:
    header = bytearray(GOOD.header)
    header[4] |= 1
    with pytest.raises(WireError):
        decoded(bytes(header) + zlib.compress(bytes(200_000_000)))


@given(st.binary(max_size=200))
def test_no_bytes_raise_anything_but_the_word_for_it(data: bytes) -> None:
    for whole in (data, GOOD.header[:61] + data):
        try:
            decoded(whole)
        except WireError:
            pass
        else:
            assert isinstance(decoded(whole), PointCloud)
