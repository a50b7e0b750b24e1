"""Sources over OpenCV: a real file is read, rewound and timed; what can't be opened says so."""

from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError

from mosaic_camera.camera import CameraParams
from mosaic_camera.grabbed import WantedSource
from mosaic_camera.marks import read_marks
from mosaic_camera.source import CaptureSource, is_device, open_source, shown
from mosaic_camera.source_error import SourceError


def test_a_file_gives_its_pictures_in_order_with_their_times(clip: Path) -> None:
    source = open_source(WantedSource(str(clip)))
    grabbed = [source.read() for _ in range(13)]
    source.close()
    assert grabbed[12] is None
    pictures = [one for one in grabbed if one is not None]
    marks = [read_marks(one.image) for one in pictures]
    assert [mark.frame for mark in marks if mark] == list(range(12))
    assert [one.position_s for one in pictures] == pytest.approx([n / 10 for n in range(12)], abs=0.01)
    assert not source.is_live


def test_a_rewound_file_starts_again_and_its_time_goes_on(clip: Path) -> None:
    source = open_source(WantedSource(f"file://{clip}"))
    for _ in range(12):
        source.read()
    source.rewind()
    again = source.read()
    source.close()
    assert again is not None
    assert again.position_s == pytest.approx(1.2, abs=0.01)
    mark = read_marks(again.image)
    assert mark is not None
    assert mark.frame == 0


class FakeCapture:
    """The part of ``cv2.VideoCapture`` that a source uses, with chosen time stamps."""

    def __init__(self, stamp_ms: float, fps: float = 25.0) -> None:
        import cv2

        self.retrieved = 0
        self._values = {cv2.CAP_PROP_POS_MSEC: stamp_ms, cv2.CAP_PROP_FPS: fps}

    def grab(self) -> bool:
        return True

    def retrieve(self) -> tuple[bool, np.ndarray]:
        self.retrieved += 1
        return True, np.zeros((2, 2, 3), dtype=np.uint8)

    def get(self, name: int) -> float:
        return self._values[name]


def test_a_stream_without_time_stamps_is_paced_by_its_frame_rate() -> None:
    source = CaptureSource(FakeCapture(stamp_ms=0.0), is_live=False)
    positions = [grabbed.position_s for _ in range(3) if (grabbed := source.read()) is not None]
    assert positions == pytest.approx([0.0, 0.04, 0.08])


@pytest.mark.parametrize("fps", [0.0, -1.0, 90000.0, float("nan")])
def test_an_impossible_frame_rate_is_replaced(fps: float) -> None:
    source = CaptureSource(FakeCapture(stamp_ms=0.0, fps=fps), is_live=False)
    source.read()
    second = source.read()
    assert second is not None
    assert second.position_s == pytest.approx(1 / 30)


def test_a_drivers_own_capture_time_is_used_and_nonsense_is_not(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("mosaic_camera.source.time.monotonic", lambda: 100.0)
    for stamp_s, expected in ((99.98, 99.98), (1.7e9, 100.0), (0.0, 100.0)):
        grabbed = CaptureSource(FakeCapture(stamp_s * 1000), is_live=True).read()
        assert grabbed is not None
        assert grabbed.captured_at_s == pytest.approx(expected)


@pytest.mark.parametrize("is_live", [True, False])
def test_a_picture_that_is_not_taken_is_not_decoded(is_live: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("mosaic_camera.source.time.monotonic", lambda: 100.0)
    capture = FakeCapture(stamp_ms=99_500)
    source = CaptureSource(capture, is_live=is_live)
    asked: list[float] = []
    for is_taken in (False, True, False):
        grabbed = source.read(lambda at_s, is_taken=is_taken: asked.append(at_s) or is_taken)  # type: ignore[func-returns-value, misc]
        assert grabbed is not None
        assert (grabbed.image is not None) is is_taken
        assert asked[-1] == (grabbed.captured_at_s if is_live else grabbed.position_s)
    assert capture.retrieved == 1
    assert asked[0] == pytest.approx(99.5)


def test_an_absent_file_is_named_with_its_whole_path(tmp_path: Path) -> None:
    with pytest.raises(SourceError, match=f"no such video file: {tmp_path}/gone.mp4"):
        open_source(WantedSource(str(tmp_path / "gone.mp4")))


def test_a_file_that_is_no_video_says_so(tmp_path: Path) -> None:
    path = tmp_path / "notes.mp4"
    path.write_text("not a video")
    with pytest.raises(SourceError, match="is not a video that can be decoded"):
        open_source(WantedSource(str(path)))


def test_an_unreadable_file_says_so(clip: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("mosaic_camera.source.os.access", lambda *_: False)
    with pytest.raises(SourceError, match="no permission to read"):
        open_source(WantedSource(str(clip)))


def test_a_camera_number_that_is_not_there_is_an_error_with_a_path() -> None:
    with pytest.raises(SourceError, match="no such camera: /dev/video97"):
        open_source(WantedSource(97))


def test_a_stream_that_nobody_serves_is_an_error_without_its_password() -> None:
    with pytest.raises(
        SourceError, match=r"no video from http://127\.0\.0\.1:9/cam: Connection refused; check"
    ) as caught:
        open_source(WantedSource("http://user:secret@127.0.0.1:9/cam"))
    assert "secret" not in str(caught.value)


def test_an_address_of_no_kind_is_told_with_the_one_that_was_meant() -> None:
    with pytest.raises(SourceError, match=r"rtps://127\.0\.0\.1/1: Protocol not found; did you mean rtsps?://\?"):
        open_source(WantedSource("rtps://user:secret@127.0.0.1/1"))


@pytest.mark.parametrize(
    ("source", "told"),
    [
        ("rtsp://admin:secret@10.0.0.2/1", "rtsp://10.0.0.2/1"),
        ("rtsp://admin:sec@ret@10.0.0.2/1", "rtsp://10.0.0.2/1"),
        ("rtsp://admin:sec/ret@10.0.0.2/1", "rtsp://10.0.0.2/1"),
        ("rtsp://admin:s@e/c@ret@10.0.0.2:554/1", "rtsp://10.0.0.2:554/1"),
        ("http://10.0.0.2:80/cam@2", "http://10.0.0.2:80/cam@2"),
        ("http://10.0.0.2/cam@2", "http://10.0.0.2/cam@2"),
        (0, "0"),
    ],
)
def test_passwords_are_never_shown(source: int | str, told: str) -> None:
    assert shown(source) == told


def test_numbers_and_dev_paths_are_devices() -> None:
    assert [is_device(source) for source in (0, "1", "/dev/video0", "a.mp4", "rtsp://x")] == [True] * 3 + [False] * 2


@pytest.mark.parametrize(
    ("source", "meant"),
    [
        ("rtps://10.0.0.5/1", "rtsp"),
        ("htpp://10.0.0.5/1", "http"),
        ("RTSP://10.0.0.5/1", None),
        ("rtp://10.0.0.5:5004", None),
        ("acme+stream://10.0.0.5", None),
        ("/dev/video0", None),
        (0, None),
    ],
)
def test_a_scheme_that_is_a_slip_is_told_before_anything_starts(source: int | str, meant: str | None) -> None:
    if meant is None:
        assert CameraParams(source=source).source == source
    else:
        with pytest.raises(ValidationError, match=f"did you mean {meant}s?://"):
            CameraParams(source=source)
