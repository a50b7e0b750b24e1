"""RealSense cameras by Intel's own library: a device in software is recorded, and the recording played as a camera."""

from __future__ import annotations

import gc
import time
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mosaic_core import DeviceGone
from mosaic_core.testing import build, take_frames
from mosaic_depth import DepthCameraParams, DepthFrame, Intrinsics
from mosaic_depth.depth_camera import fault_of
from mosaic_depth.pictures import DepthCameraConfigurer
from mosaic_depth.realsense import RealSenseCamera

rs: Any = pytest.importorskip("pyrealsense2", reason="there is no wheel of it for this Python or machine")

WIDTH, HEIGHT = 64, 48
DEPTH_FX, COLOUR_FX = 50.0, 60.0


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Forty pictures: a wall 1.5 m ahead, whose left half is not known; blue in the upper half, red below."""
    path = tmp_path_factory.mktemp("realsense") / "wall.db3"
    record(path, rs.format.bgr8)
    return path


def record(path: Path, colours: Any) -> None:
    device = rs.software_device()
    streams = [
        (device.add_sensor("Stereo"), stream_of(rs.stream.depth, 1, rs.format.z16, 2, DEPTH_FX), depth_pixels(), 2),
        (device.add_sensor("RGB"), stream_of(rs.stream.color, 2, colours, 3, COLOUR_FX), colour_pixels(), 3),
    ]
    profiles = [sensor.add_video_stream(stream) for sensor, stream, _, _ in streams]
    streams[0][0].add_read_only_option(rs.option.depth_units, 0.001)
    in_one_place = rs.extrinsics()
    in_one_place.rotation, in_one_place.translation = [1, 0, 0, 0, 1, 0, 0, 0, 1], [0, 0, 0]
    profiles[0].register_extrinsics_to(profiles[1], in_one_place)
    device.create_matcher(rs.matchers.default)
    recorder = rs.recorder(str(path), device)
    sensors = recorder.query_sensors()
    for sensor in sensors:
        sensor.open(sensor.get_stream_profiles()[0])
        sensor.start(lambda frame: None)
    for number in range(1, 41):
        for (sensor, _, pixels, size), profile in zip(streams, profiles, strict=True):
            sensor.on_video_frame(frame_of(pixels, size, number, profile))
        time.sleep(0.02)  # the pace at which it will be played
    for sensor in sensors:
        sensor.stop()
        sensor.close()
    del recorder, sensors, sensor
    gc.collect()  # the library writes the end of the file when the recorder goes


def stream_of(kind: Any, number: int, form: Any, size: int, focal_px: float) -> Any:
    stream, pinhole = rs.video_stream(), rs.intrinsics()
    pinhole.width, pinhole.height, pinhole.fx, pinhole.fy = WIDTH, HEIGHT, focal_px, focal_px
    pinhole.ppx, pinhole.ppy, pinhole.coeffs, pinhole.model = WIDTH / 2, HEIGHT / 2, [0.0] * 5, rs.distortion.none
    stream.type, stream.index, stream.uid, stream.fmt, stream.bpp = kind, 0, number, form, size
    stream.width, stream.height, stream.fps, stream.intrinsics = WIDTH, HEIGHT, 30, pinhole
    return stream


def depth_pixels() -> np.ndarray:
    pixels = np.full((HEIGHT, WIDTH), 1500, np.uint16)
    pixels[:, : WIDTH // 2] = 0
    return pixels


def colour_pixels() -> np.ndarray:
    pixels = np.zeros((HEIGHT, WIDTH, 3), np.uint8)
    pixels[: HEIGHT // 2, :, 0] = 250
    pixels[HEIGHT // 2 :, :, 2] = 240
    return pixels


def frame_of(pixels: np.ndarray, size: int, number: int, profile: Any) -> Any:
    frame = rs.software_video_frame()
    frame.pixels, frame.stride, frame.bpp = pixels, WIDTH * size, size
    frame.timestamp, frame.domain = number * 1000 / 30, rs.timestamp_domain.system_time
    frame.frame_number, frame.profile = number, profile.as_video_stream_profile()
    return frame


@pytest.fixture
def camera(recording: Path) -> Iterator[RealSenseCamera]:
    with closing(RealSenseCamera(params_of(recording))) as opened:
        yield opened


def params_of(address: object) -> DepthCameraParams:
    return DepthCameraParams(source=f"realsense:{address}")


def next_of(camera: RealSenseCamera) -> DepthFrame:
    for _ in range(60):
        frame = camera.next(0.5)
        if frame is not None:
            return frame
    raise AssertionError("no pictures within half a minute")


def test_depth_is_in_metres_over_the_colour_whose_pinhole_it_has(camera: RealSenseCamera) -> None:
    frame = next_of(camera)
    assert fault_of(frame) == ""
    assert frame.intrinsics == Intrinsics(COLOUR_FX, COLOUR_FX, WIDTH / 2, HEIGHT / 2)
    assert np.unique(frame.depth_m[:, WIDTH // 2 + 2 :]).tolist() == pytest.approx([1.5])
    assert np.unique(frame.depth_m[:, : WIDTH // 2 - 2]).tolist() == [0.0]
    assert frame.colour[0, 0].tolist() == [250, 0, 0]
    assert frame.colour[-1, -1].tolist() == [0, 0, 240]
    assert frame.captured_at_s is None


def test_pictures_stay_as_they_are_while_further_ones_come(camera: RealSenseCamera) -> None:
    first = next_of(camera)
    kept = first.depth_m.copy(), first.colour.copy()
    for _ in range(10):
        next_of(camera)
    assert (first.depth_m == kept[0]).all()
    assert (first.colour == kept[1]).all()


def test_a_recording_begins_again_and_may_be_opened_again(recording: Path) -> None:
    for _ in range(2):
        with closing(RealSenseCamera(params_of(recording))) as camera:
            assert all(fault_of(next_of(camera)) == "" for _ in range(50))


def test_colours_that_were_recorded_as_rgb_are_turned(tmp_path: Path) -> None:
    record(tmp_path / "rgb.db3", rs.format.rgb8)
    with closing(RealSenseCamera(params_of(tmp_path / "rgb.db3"))) as camera:
        assert next_of(camera).colour[0, 0].tolist() == [0, 0, 250]


def test_the_connector_plays_it(recording: Path) -> None:
    handler = build(DepthCameraConfigurer, params={"camera": {"source": f"realsense:{recording}"}})
    assert [one.image.shape for one in take_frames(handler, 2)] == [(HEIGHT, WIDTH, 3)] * 2  # type: ignore[union-attr]


def test_what_is_not_there_is_told_with_what_to_do(tmp_path: Path) -> None:
    with pytest.raises(DeviceGone, match=r"no recording .*none\.db3; is the path right"):
        RealSenseCamera(params_of(tmp_path / "none.db3"))
    (tmp_path / "torn.db3").write_bytes(b"SQLite format 3\0 and no more")
    with pytest.raises(DeviceGone, match=r"torn\.db3"):
        RealSenseCamera(params_of(tmp_path / "torn.db3"))
    if not list(rs.context().query_devices()):
        with pytest.raises(DeviceGone, match="no RealSense camera; plug it in"):
            RealSenseCamera(params_of(""))
