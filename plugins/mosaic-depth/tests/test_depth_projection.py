"""Points and colours of pictures: each point lies where its pixel looks, at its depth, in its colour."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_depth import DepthFrame, Intrinsics
from mosaic_depth.colouring import coloured
from mosaic_depth.depth_camera import fault_of
from mosaic_depth.projection import cloud_of_frame

PINHOLE = Intrinsics(fx_px=50.0, fy_px=40.0, cx_px=7.5, cy_px=5.5)


def frame_of(depth_m: np.ndarray, pinhole: Intrinsics = PINHOLE) -> DepthFrame:
    height, width = depth_m.shape
    colour = np.zeros((height, width, 3), np.uint8)
    colour[..., 0] = np.arange(width)
    colour[..., 1] = np.arange(height)[:, None]
    colour[..., 2] = 200
    return DepthFrame(colour, depth_m, pinhole, 12.5)


def test_a_pixel_right_of_the_axis_and_below_it_is_a_point_ahead_to_the_right_and_down() -> None:
    depth = np.zeros((12, 16), np.float32)
    depth[10, 12] = 2.0
    cloud = cloud_of_frame(frame_of(depth), frame_id="front")
    assert cloud.xyz.tolist() == [pytest.approx([2.0, -(12 - 7.5) * 2 / 50, -(10 - 5.5) * 2 / 40])]
    assert cloud.rgb is not None
    assert cloud.rgb.tolist() == [[200, 10, 12]]
    assert (cloud.frame_id, cloud.captured_at_s) == ("front", 12.5)


@given(
    size=st.tuples(st.integers(2, 24), st.integers(2, 24)),
    step_px=st.integers(1, 5),
    seed=st.integers(0, 2**32 - 1),
)
def test_every_point_looks_through_the_pixel_that_gave_it_its_colour(
    size: tuple[int, int], step_px: int, seed: int
) -> None:
    dice = np.random.default_rng(seed)
    depth = dice.choice([0.0, -1.0, np.nan, np.inf, 0.5, 3.0, 9.0], size=size).astype(np.float32)
    cloud = cloud_of_frame(frame_of(depth), step_px)
    looked_at = depth[::step_px, ::step_px]
    assert len(cloud) == np.count_nonzero(np.isfinite(looked_at) & (looked_at > 0))
    assert cloud.rgb is not None
    columns = np.rint(PINHOLE.cx_px - cloud.xyz[:, 1] / cloud.xyz[:, 0] * PINHOLE.fx_px).astype(int)
    rows = np.rint(PINHOLE.cy_px - cloud.xyz[:, 2] / cloud.xyz[:, 0] * PINHOLE.fy_px).astype(int)
    assert (cloud.rgb[:, 2] == columns).all()
    assert (cloud.rgb[:, 1] == rows).all()
    assert (cloud.xyz[:, 0] == depth[rows, columns]).all()


def test_near_is_red_far_is_blue_and_unknown_is_black() -> None:
    depth = np.array([[0.1, 0.5, 4.0, 90.0, 0.0, -1.0, np.nan, np.inf]], np.float32)
    (blue, _, red) = np.moveaxis(coloured(depth, 0.5, 4.0).astype(int), -1, 0)
    assert (red[0, :2] > blue[0, :2] + 50).all()
    assert (blue[0, 2:4] > red[0, 2:4]).all()
    assert coloured(depth, 0.5, 4.0)[0, 4:].max() == 0
    assert (coloured(depth, 0.5, 4.0)[0, :4].max(axis=1) > 0).all()


@given(st.lists(st.floats(0.5, 4.0), min_size=2, max_size=20))
def test_what_is_farther_is_never_redder_in_the_order_of_the_palette(depths: list[float]) -> None:
    from mosaic_depth.colouring import _palette

    places = {tuple(colour): place for place, colour in reversed(list(enumerate(_palette().tolist())))}
    picture = coloured(np.array([sorted(depths)], np.float32), 0.5, 4.0)
    found = [places[tuple(colour)] for colour in picture[0].tolist()]
    assert found == sorted(found, reverse=True)


GOOD = frame_of(np.ones((12, 16), np.float32))


@pytest.mark.parametrize(
    ("frame", "told"),
    [
        (DepthFrame(GOOD.colour[:, :, 0], GOOD.depth_m, PINHOLE), r"colour picture of uint8 \(12, 16\)"),
        (DepthFrame(GOOD.colour.astype(float), GOOD.depth_m, PINHOLE), "colour picture of float64"),
        (DepthFrame(GOOD.colour, GOOD.depth_m[1:], PINHOLE), r"depth picture of float32 \(11, 16\)"),
        (DepthFrame(GOOD.colour, GOOD.depth_m.astype(np.uint16), PINHOLE), "depth picture of uint16"),
        (frame_of(np.ones((1, 16))), "pictures of 16x1 pixels"),
        (frame_of(np.ones((2, 4097))), "pictures of 4097x2 pixels"),
        (frame_of(np.ones((12, 16)), Intrinsics(0, 40, 7, 5)), "no pinhole"),
        (frame_of(np.ones((12, 16)), Intrinsics(50, 40, float("nan"), 5)), "no pinhole"),
    ],
)
def test_pictures_that_do_not_belong_together_are_told_with_what_is_wrong(frame: DepthFrame, told: str) -> None:
    assert fault_of(GOOD) == ""
    with pytest.raises(AssertionError, match=told):
        assert fault_of(frame) == "", fault_of(frame)
