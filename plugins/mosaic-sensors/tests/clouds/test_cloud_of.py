"""Any usual array of points becomes a cloud; what can't be one is named."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from mosaic_sensors.point_cloud import cloud_of

XYZ = np.array([[1, 2, 3], [4, 5, 6]], dtype=np.float32)


def test_three_columns_are_coordinates_and_a_fourth_is_intensity() -> None:
    assert cloud_of(XYZ).intensity is None
    cloud = cloud_of(np.column_stack([XYZ, [0.5, 0.7]]))
    assert cloud.xyz.tolist() == XYZ.tolist()
    assert cloud.intensity is not None
    assert cloud.intensity.tolist() == [0.5, 0.7]


def test_an_image_of_points_and_integers_and_an_empty_list_are_clouds_too() -> None:
    assert len(cloud_of(np.zeros((4, 5, 3), np.float32))) == 20
    assert cloud_of(np.array([[1, 2, 3]], dtype=np.int16)).xyz.dtype == np.float32
    assert cloud_of(np.array([[400_000_123, 2, 3]])).xyz[0, 0] == 400_000_123
    assert len(cloud_of([])) == 0
    assert len(cloud_of(np.empty((0, 4)))) == 0


def test_points_that_are_nowhere_are_left_out_with_their_intensity_and_colour() -> None:
    xyz = np.array([[0, 0, 0], [np.nan, 0, 0], [0, np.inf, 0], [1, 1, 1]])
    cloud = cloud_of(xyz, intensity=[1, 2, 3, 4], rgb=[[1, 1, 1], [2, 2, 2], [3, 3, 3], [4, 4, 4]])
    assert cloud.xyz[:, 0].tolist() == [0, 1]
    assert cloud.intensity is not None
    assert cloud.intensity.tolist() == [1, 4]
    assert cloud.rgb is not None
    assert cloud.rgb[:, 0].tolist() == [1, 4]


def structured(**columns: Any) -> Any:
    arrays = {name: np.asarray(column) for name, column in columns.items()}
    made = np.zeros(2, dtype=[(name, array.dtype) for name, array in arrays.items()])
    for name, array in arrays.items():
        made[name] = array
    return made


def test_fields_are_found_by_their_usual_names() -> None:
    cloud = cloud_of(structured(x=[1.0, 2], y=[3.0, 4], z=[5.0, 6], Intensity=[7, 8], t=[0, 0]))
    assert cloud.xyz.tolist() == [[1, 3, 5], [2, 4, 6]]
    assert cloud.intensity is not None
    assert cloud.intensity.tolist() == [7, 8]
    place = {"x": [1.0, 2], "y": [3.0, 4], "z": [5.0, 6]}
    bytes_each = {name: np.array([10, 20], np.uint8) for name in ("red", "green", "blue")}
    coloured = cloud_of(structured(**place, **bytes_each))
    assert coloured.rgb is not None
    assert coloured.rgb.tolist() == [[10, 10, 10], [20, 20, 20]]


@pytest.mark.parametrize("kind", [np.float32, np.uint32])
def test_a_colour_packed_as_pcl_does_is_unpacked(kind: type) -> None:
    packed: Any = np.array([0x00FF8001, 0x00000102], np.uint32).view(kind)
    cloud = cloud_of(structured(x=[1.0, 2], y=[3.0, 4], z=[5.0, 6], rgb=packed))
    assert cloud.rgb is not None
    assert cloud.rgb.tolist() == [[255, 128, 1], [0, 1, 2]]


def test_colours_may_be_fractions_bytes_or_sixteen_bit() -> None:
    def rgb(values: Any) -> Any:
        cloud = cloud_of(XYZ, rgb=values)
        assert cloud.rgb is not None
        return cloud.rgb.tolist()

    assert rgb([[0.0, 0.5, 1.0], [2.0, -1.0, np.nan]]) == [[0, 128, 255], [255, 0, 0]]
    assert rgb(np.array([[0, 128, 255]] * 2, np.int64)) == [[0, 128, 255]] * 2
    assert rgb(np.array([[0, 257 * 128, 65535]] * 2, np.uint16)) == [[0, 128, 255]] * 2


@pytest.mark.parametrize(
    ("points", "more", "said"),
    [
        (np.zeros((2, 2)), {}, r"shape \(2, 2\)"),
        (np.zeros(3), {}, r"shape \(3,\)"),
        (np.array([["a", "b", "c"]]), {}, "numbers are expected"),
        (XYZ, {"intensity": [1]}, "intensity has 1 rows for 2 points"),
        (XYZ, {"intensity": ["a", "b"]}, "not numbers"),
        (XYZ, {"rgb": [[1, 2, 3]]}, "rgb has 1 rows for 2 points"),
        (XYZ, {"rgb": [1, 2, 3]}, "rgb of shape"),
        (structured(x=[1.0, 2], z=[1.0, 2]), {}, "no field y among x, z"),
    ],
)
def test_what_does_not_fit_is_named(points: Any, more: dict[str, Any], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        cloud_of(points, **more)
