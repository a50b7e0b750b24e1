"""The connector `camera`: real files through the kit, on a fake clock."""

import time
from collections.abc import Generator, Sequence
from pathlib import Path
from typing import cast

import numpy as np
import pytest

from mosaic_camera.camera import Camera, CameraConfigurer, OpencvSenderCameraConfigurer
from mosaic_camera.grabbed import Grabbed, Takes, takes_all
from mosaic_camera.marks import read_marks
from mosaic_camera.source import CaptureSource
from mosaic_camera.source_error import SourceError
from mosaic_core import Captured, ConfigError
from mosaic_core.testing import FakeClock, build, take_frames


def numbers(pictures: Sequence[object]) -> list[int]:
    found = []
    for picture in pictures:
        assert isinstance(picture, Captured)
        mark = read_marks(np.asarray(picture.image))
        assert mark is not None
        found.append(mark.frame)
    return found


def times(pictures: Sequence[object]) -> np.ndarray:
    return np.array([picture.captured_at_s for picture in pictures if isinstance(picture, Captured)])


def test_a_file_plays_once_and_then_ends(clip: Path) -> None:
    camera = build(CameraConfigurer, params={"source": str(clip), "loop": False})
    assert numbers(take_frames(camera)) == list(range(12))


def test_a_file_plays_again_and_again_by_default(clip: Path) -> None:
    camera = build(CameraConfigurer, params={"source": str(clip)})
    assert numbers(take_frames(camera, 26)) == [*range(12), *range(12), 0, 1]


def test_a_file_is_paced_by_its_own_time_stamps(clip: Path, fake_clock: FakeClock) -> None:
    camera = build(CameraConfigurer, params={"source": str(clip)}, clock=fake_clock)
    began_s = fake_clock.now_s
    assert times(take_frames(camera, 25)) == pytest.approx([began_s + n / 10 for n in range(25)], abs=0.02)


def test_fps_thins_a_file_and_keeps_its_speed(clip: Path, fake_clock: FakeClock) -> None:
    camera = build(CameraConfigurer, params={"source": str(clip), "fps": 5}, clock=fake_clock)
    pictures = take_frames(camera, 5)
    assert numbers(pictures) == [0, 2, 4, 6, 8]
    assert np.diff(times(pictures)) == pytest.approx([0.2] * 4, abs=0.02)


def test_a_file_whose_reader_was_held_up_goes_on_instead_of_racing(clip: Path, fake_clock: FakeClock) -> None:
    camera = build(CameraConfigurer, params={"source": str(clip)}, clock=fake_clock)
    stamps: list[float] = []
    frames = cast("Generator[Captured]", camera.frames())
    for frame in frames:
        stamps.append(frame.captured_at_s)
        if len(stamps) == 2:
            fake_clock.advance(30.0)
        if len(stamps) == 6:
            break
    frames.close()
    assert np.diff(np.array(stamps))[2:] == pytest.approx([0.1] * 3, abs=0.02)


@pytest.mark.parametrize(
    ("params", "shape"),
    [
        ({}, (240, 320, 3)),
        ({"width": 160}, (120, 160, 3)),
        ({"width": "160", "height": "160"}, (160, 160, 3)),
        ({"rotation": 90}, (320, 240, 3)),
        ({"flip": "both", "rotation": 270, "height": 120}, (160, 120, 3)),
    ],
)
def test_pictures_have_the_wanted_size_and_rotation(
    clip: Path, params: dict[str, object], shape: tuple[int, int, int]
) -> None:
    (picture,) = take_frames(build(CameraConfigurer, params={"source": str(clip), **params}), 1)
    assert isinstance(picture, Captured)
    assert np.asarray(picture.image).shape == shape


def test_a_source_that_is_not_there_raises_in_the_body_so_that_the_runner_tries_again(tmp_path: Path) -> None:
    path = tmp_path / "later.mp4"
    camera = build(CameraConfigurer, params={"source": str(path)})
    for _ in range(2):
        with pytest.raises(SourceError, match="no such video file"):
            take_frames(camera, 1)


def test_a_source_that_comes_back_is_used_again(tmp_path: Path, clip: Path) -> None:
    path = tmp_path / "later.mp4"
    camera = build(CameraConfigurer, params={"source": str(path)})
    with pytest.raises(SourceError):
        take_frames(camera, 1)
    path.write_bytes(clip.read_bytes())
    assert numbers(take_frames(camera, 2)) == [0, 1]


class Lost:
    """A camera that is unplugged after two pictures."""

    is_live = True
    keeps_order = False

    def __init__(self) -> None:
        self._left = 2

    def read(self, takes: Takes = takes_all) -> Grabbed | None:
        self._left -= 1
        return Grabbed(np.zeros((4, 4, 3), dtype=np.uint8), 0.0) if self._left >= 0 else None

    def rewind(self) -> None: ...
    def close(self) -> None: ...


def test_an_unplugged_camera_raises_with_its_name(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("mosaic_camera.camera.open_source", lambda wanted: Lost())
    with pytest.raises(SourceError, match="/dev/video0 was lost"):
        take_frames(build(CameraConfigurer), 3)


class Silent(Lost):
    """A camera whose driver waits for ever."""

    def read(self, takes: Takes = takes_all) -> Grabbed | None:
        import threading

        threading.Event().wait(2.0)
        return None


def test_a_camera_that_falls_silent_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("mosaic_camera.camera.open_source", lambda wanted: Silent())
    monkeypatch.setattr("mosaic_camera.camera.FIRST_PICTURE_S", 0.4)
    with pytest.raises(SourceError, match=r"no picture from /dev/video0 for 0\.4 s"):
        take_frames(build(CameraConfigurer), 1)


class Rapid(Lost):
    """Ten pictures a second of its own, handed over at once; then it is unplugged."""

    def __init__(self) -> None:
        self._left = 20

    def read(self, takes: Takes = takes_all) -> Grabbed | None:
        import threading

        threading.Event().wait(0.05)
        self._left -= 1
        if self._left < 0:
            return None
        return Grabbed(np.zeros((4, 4, 3), dtype=np.uint8) if takes(-self._left / 10) else None, 0.0)


def test_pictures_that_are_left_out_are_no_silence(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("mosaic_camera.camera.open_source", lambda wanted: Rapid())
    monkeypatch.setattr("mosaic_camera.camera.SILENCE_S", 0.4)
    camera = build(CameraConfigurer, params={"fps": 0.1})
    with pytest.raises(SourceError, match="was lost"):
        take_frames(camera)


class Capture:
    """``cv2.VideoCapture`` of a camera with 30 pictures a second, one second long."""

    def __init__(self) -> None:
        self.began_s = time.monotonic() - 0.95
        self.grabbed = self.retrieved = 0

    def grab(self) -> bool:
        self.grabbed += 1
        return self.grabbed <= 30

    def get(self, name: int) -> float:
        return (self.began_s + self.grabbed / 30 - 0.05) * 1000

    def retrieve(self) -> tuple[bool, np.ndarray]:
        self.retrieved += 1
        return True, np.zeros((4, 4, 3), dtype=np.uint8)

    def release(self) -> None: ...


def test_of_a_faster_camera_only_the_wanted_pictures_are_decoded(monkeypatch: pytest.MonkeyPatch) -> None:
    capture = Capture()
    monkeypatch.setattr("mosaic_camera.camera.open_source", lambda wanted: CaptureSource(capture, is_live=True))
    with pytest.raises(SourceError, match="was lost"):
        take_frames(build(CameraConfigurer, params={"fps": 5}))
    assert capture.grabbed == 31
    assert 4 <= capture.retrieved <= 6


@pytest.mark.parametrize(
    "params", [{"rotation": 45}, {"flip": "sideways"}, {"fps": 0}, {"width": -1}, {"sources": "/dev/video0"}]
)
def test_wrong_params_are_refused_before_anything_starts(params: dict[str, object]) -> None:
    with pytest.raises(ConfigError):
        build(CameraConfigurer, params=params)


def test_the_original_connectors_params_may_be_strings() -> None:
    params = {"fps": "15", "camera_id": "2", "width": "320", "height": "240"}
    camera = build(OpencvSenderCameraConfigurer, params=params)
    assert isinstance(camera, Camera)
    assert camera._params.source == 2
    assert (camera._params.width, camera._params.height, camera._params.fps) == (320, 240, 15)
    with pytest.raises(SourceError, match="/dev/video2"):
        take_frames(camera, 1)


def test_the_original_connector_needs_no_params() -> None:
    assert build(OpencvSenderCameraConfigurer)._params.source == 0


def test_the_original_connector_takes_a_low_maximum_without_a_minimum() -> None:
    camera = build(OpencvSenderCameraConfigurer, params={"max_bitrate_bps": 100_000})
    assert camera.encoding.least_bps == 100_000


def test_cameras_run_only_while_somebody_watches() -> None:
    assert Camera.runs == "watched"
    assert Camera.widget == "video"
