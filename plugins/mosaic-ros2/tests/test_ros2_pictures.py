"""Images of ROS as pictures, and clouds as arrays: encodings, rows, byte orders, and what does not fit."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
import pytest

from mosaic_ros2.conversion.clouds import cloud_from
from mosaic_ros2.conversion.pictures import decompressed, picture_of

BGR = np.dstack([np.full((4, 6), value, np.uint8) for value in (200, 100, 50)])


def image(encoding: str, array: Any, *, step: int = 0, big: bool = False) -> dict[str, Any]:
    array = np.ascontiguousarray(array)
    row = array.nbytes // array.shape[0]
    data = np.zeros((array.shape[0], step or row), np.uint8)
    data[:, :row] = array.view(np.uint8).reshape(array.shape[0], row)
    return {
        "height": array.shape[0], "width": array.shape[1], "encoding": encoding, "is_bigendian": int(big),
        "step": step or row, "data": data.reshape(-1),
    }  # fmt: skip


@pytest.mark.parametrize(
    ("encoding", "array"),
    [
        ("bgr8", BGR),
        ("rgb8", BGR[..., ::-1]),
        ("bgra8", np.dstack([BGR, BGR[..., 0]])),
        ("rgba8", np.dstack([BGR[..., ::-1], BGR[..., 0]])),
        ("bgr16", BGR.astype(np.uint16) * 257),
        ("rgb16", BGR[..., ::-1].astype(np.uint16) * 257),
    ],
)
def test_colours_arrive_as_bgr_with_and_without_padded_rows(encoding: str, array: Any) -> None:
    for step in (0, 64):
        np.testing.assert_array_equal(picture_of(image(encoding, array, step=step), 10), BGR)


def test_what_is_bgr_already_is_not_copied() -> None:
    message = image("bgr8", BGR)
    assert np.shares_memory(picture_of(message, 10), message["data"])


def test_gray_of_8_and_16_bits_in_both_byte_orders() -> None:
    gray = np.arange(24, dtype=np.uint8).reshape(4, 6)
    np.testing.assert_array_equal(picture_of(image("mono8", gray), 10), gray)
    wide = gray.astype(np.uint16) * 257
    np.testing.assert_array_equal(picture_of(image("mono16", wide), 10), gray)
    np.testing.assert_array_equal(picture_of(image("mono16", wide.astype(">u2"), big=True), 10), gray)


@pytest.mark.parametrize("encoding", ["bayer_rggb8", "bayer_bggr8", "bayer_gbrg8", "bayer_grbg8"])
def test_a_bayer_mosaic_has_its_colours_where_they_are(encoding: str) -> None:
    order = encoding[6:10]
    values = {"b": 200, "g": 100, "r": 50}
    tile = np.array([[values[order[0]], values[order[1]]], [values[order[2]], values[order[3]]]], np.uint8)
    found = picture_of(image(encoding, np.tile(tile, (6, 6))), 10)
    np.testing.assert_array_equal(found[6, 6], (200, 100, 50))


@pytest.mark.parametrize(
    ("encoding", "code"), [("yuv422", cv2.COLOR_YUV2BGR_UYVY), ("yuv422_yuy2", cv2.COLOR_YUV2BGR_YUY2)]
)
def test_yuv422_is_read_in_both_orders(encoding: str, code: int) -> None:
    raw = np.random.default_rng(1).integers(0, 255, (4, 6, 2), np.uint8)
    np.testing.assert_array_equal(picture_of(image(encoding, raw), 10), cv2.cvtColor(raw, code))


@pytest.mark.parametrize(("encoding", "scale", "dtype"), [("16UC1", 1000, np.uint16), ("32FC1", 1, np.float32)])
def test_distances_are_lighter_the_nearer_and_black_where_nothing_was_measured(
    encoding: str, scale: float, dtype: Any
) -> None:
    metres = np.array([[0, 1, 5, 10, 11]], np.float64)
    found = picture_of(image(encoding, (metres * scale).astype(dtype)), 10.0)[0]
    assert found[0] == found[3] == found[4] == 0
    assert found[1] > found[2] > 100
    if dtype is np.float32:
        bad = np.array([[np.nan, np.inf, -np.inf]], np.float32)
        assert not picture_of(image(encoding, bad), 10.0).any()


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"encoding": "rgb565"}, "is not known"),
        ({"width": 0}, "no size"),
        ({"width": 100_000, "height": 100_000}, "no size"),
        ({"height": 5}, "are no 6×5"),
        ({"step": 3}, "are no 6×4"),
    ],
)
def test_an_image_that_does_not_fit_is_refused(changes: dict[str, Any], reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        picture_of({**image("bgr8", BGR), **changes}, 10)


def test_a_compressed_picture_is_read_and_what_is_none_is_told() -> None:
    png = cv2.imencode(".png", BGR)[1]
    np.testing.assert_array_equal(decompressed({"format": "bgr8; png compressed bgr8", "data": png}), BGR)
    for data, kind in (
        (np.zeros(0, np.uint8), "jpeg"),
        (np.zeros(9, np.uint8), "jpeg"),
        (png, "16UC1; compressedDepth"),
    ):
        with pytest.raises(ValueError, match=r"no picture|compressedDepth"):
            decompressed({"format": kind, "data": data})


def cloud(points: Any, columns: str = "x y z intensity", **changes: Any) -> dict[str, Any]:
    points = np.asarray(points, np.float32)
    names = columns.split()
    return {
        "header": {"frame_id": "lidar"}, "height": 1, "width": len(points), "is_bigendian": False,
        "fields": [{"name": name, "offset": 4 * at, "datatype": 7, "count": 1} for at, name in enumerate(names)],
        "point_step": 4 * len(names), "row_step": points.nbytes, "data": points.reshape(-1).view(np.uint8), **changes,
    }  # fmt: skip


def test_a_cloud_has_its_points_without_those_that_are_not_finite() -> None:
    found = cloud_from(cloud([[1, 2, 3, 9], [np.nan, 0, 0, 0], [4, 5, 6, 8]]), 7.0)
    assert found.xyz.tolist() == [[1, 2, 3], [4, 5, 6]]
    assert found.intensity is not None
    assert found.intensity.tolist() == [9, 8]
    assert (found.frame_id, found.captured_at_s) == ("lidar", 7.0)


def test_an_organized_cloud_with_padded_rows_and_the_other_byte_order() -> None:
    values = np.arange(18, dtype=">f4").reshape(2, 9)
    padded = np.zeros((2, 40), np.uint8)
    padded[:, :36] = values.view(np.uint8).reshape(2, 36)
    message = cloud(
        np.zeros((0, 3)), "x y z", height=2, width=3, row_step=40, data=padded.reshape(-1), is_bigendian=True
    )
    assert cloud_from(message, 0.0).xyz.tolist() == np.arange(18).reshape(6, 3).tolist()


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"width": 5}, "are no 5×1"),
        ({"fields": [{"name": "x", "offset": 14, "datatype": 7, "count": 1}]}, "does not lie within"),
        ({"fields": [{"name": "x", "offset": 0, "datatype": 99, "count": 1}]}, "does not lie within"),
        ({"fields": []}, "no names"),
        ({"fields": [{"name": "r", "offset": 0, "datatype": 7, "count": 1}]}, "no field x, y, z"),
    ],
)
def test_a_cloud_that_does_not_fit_is_refused(changes: dict[str, Any], reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        cloud_from(cloud([[1, 2, 3, 4]], **changes), 0.0)
