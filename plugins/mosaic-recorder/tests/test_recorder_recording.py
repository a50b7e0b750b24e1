"""One camera's recording on its thread: commands, limits, and everything that goes wrong."""

from __future__ import annotations

import errno
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from mosaic_core.contract.media_tap import TappedPicture
from mosaic_recorder import camera_recording as recording_module
from mosaic_recorder.camera_recording import CameraRecording
from mosaic_recorder.clip_writer import ClipWriter
from mosaic_recorder.recording import Limits


class Set:
    """A recording and everything around it."""

    def __init__(self, studio: Any, folder: Path) -> None:
        self.studio = studio
        self.folder = folder
        self.taps: list[Any] = []
        self.told: list[str] = []
        self.tap = studio.Tap

    def recording(
        self, *taps: Any, limits: Limits | None = None, check_disk: Callable[[], str] = str
    ) -> CameraRecording:
        """Each tap serves from one start or resume to the next pause."""
        waiting = list(taps)

        def open_tap() -> Any:
            self.taps.append(waiting.pop(0))
            return self.taps[-1]

        clip = ClipWriter("mp4", lambda: self.folder / "a.mp4", lambda path: None)
        made = CameraRecording(
            "front", open_tap, clip, limits or Limits(), changed=lambda: self.told.append(made.status().state),
            check_disk=check_disk,
        )  # fmt: skip
        return made

    def movie(self) -> Any:
        return self.studio.watched(self.folder / "a.mp4")


@pytest.fixture
def stage(studio: Any, tmp_path: Path) -> Set:
    return Set(studio, tmp_path)


def ended(recording: CameraRecording) -> str:
    """The code with which it ended, or has been stopped."""
    assert recording.join(20)
    assert recording.has_ended
    assert not recording.is_running
    return recording.status().code


def test_it_records_until_it_is_stopped(stage: Set) -> None:
    tap = stage.tap(stage.studio.encoded(45))
    recording = stage.recording(tap)
    recording.start()
    tap.wait_until_taken()
    stage.studio.until(lambda: recording.status().pictures == 45)
    recording.wish("stop")
    assert ended(recording) == ""
    assert stage.movie().numbers == list(range(45))
    assert stage.told == ["recording", "ended"]
    assert not tap.is_open
    status = recording.status()
    assert (status.files, status.seconds, status.width, status.height) == (("a.mp4",), 1.5, 320, 240)


def test_a_pause_lets_the_camera_rest_and_is_left_out(stage: Set) -> None:
    pictures = stage.studio.encoded(60, key_every=20)
    later = tuple(replace(one, captured_at_s=one.captured_at_s + 100) for one in pictures[40:])
    first, second = stage.tap(pictures[:15]), stage.tap(later)
    recording = stage.recording(first, second)
    recording.start()
    stage.studio.until(lambda: recording.status().pictures == 15)
    recording.wish("pause")
    stage.studio.until(lambda: recording.status().state == "paused")
    assert not first.is_open
    assert recording.is_running
    recording.wish("record")
    stage.studio.until(lambda: recording.status().pictures == 35)
    recording.wish("stop")
    assert ended(recording) == ""
    assert stage.movie().numbers == [*range(15), *range(40, 60)]
    assert stage.movie().duration_s == pytest.approx(35 / 30, abs=0.002)


def test_a_paused_recording_can_be_stopped_and_then_never_resumed(stage: Set) -> None:
    recording = stage.recording(stage.tap(stage.studio.encoded(5)))
    recording.start()
    stage.studio.until(lambda: recording.status().pictures == 5)
    recording.wish("pause")
    stage.studio.until(lambda: recording.status().state == "paused")
    recording.wish("stop")
    recording.wish("record")
    assert ended(recording) == ""
    assert len(stage.taps) == 1


@pytest.mark.parametrize(("max_seconds", "pictures"), [(1.0, 30), (0.5, 15), (0.01, 0)])
def test_it_ends_at_its_longest_time(stage: Set, max_seconds: float, pictures: int) -> None:
    recording = stage.recording(stage.tap(stage.studio.encoded(60)), limits=Limits(max_seconds=max_seconds))
    recording.start()
    assert ended(recording) == "recorder.max_seconds"
    assert recording.status().pictures == pictures
    assert recording.status().seconds <= max_seconds


@pytest.mark.parametrize("max_bytes", [5_000, 9_000, 13_000])
def test_it_ends_before_its_files_are_too_large(stage: Set, max_bytes: int) -> None:
    pictures = stage.studio.encoded(100)
    assert sum(len(picture.data) for picture in pictures) > max_bytes
    recording = stage.recording(stage.tap(pictures), limits=Limits(max_bytes=max_bytes))
    recording.start()
    assert ended(recording) == "recorder.max_bytes"
    files = list(stage.folder.iterdir())
    assert sum(file.stat().st_size for file in files) <= max_bytes
    assert recording.status().bytes <= max_bytes


@pytest.mark.parametrize("code", ["channel.unknown_label", "media.no_encoder", "peer.shutdown"])
def test_a_tap_that_can_give_nothing_ends_it_with_its_code(stage: Set, code: str) -> None:
    recording = stage.recording(stage.tap(stage.studio.encoded(10), failure=code))
    recording.start()
    assert ended(recording) == code
    assert stage.movie().numbers == list(range(10))


def test_a_disk_without_room_ends_it_and_the_file_plays(stage: Set) -> None:
    reasons = iter([""] * 20 + ["recorder.disk_full"] * 80)
    recording = stage.recording(stage.tap(stage.studio.encoded(60)), check_disk=lambda: next(reasons))
    recording.start()
    assert ended(recording) == "recorder.disk_full"
    assert stage.movie().numbers == list(range(21))


@pytest.mark.parametrize(
    ("number", "code"),
    [(errno.ENOSPC, "recorder.disk_full"), (errno.EDQUOT, "recorder.disk_full"), (errno.EIO, "recorder.write_failed")],
)
def test_an_error_of_the_disk_ends_it_with_a_code(
    stage: Set, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture, number: int, code: str
) -> None:
    def fails(clip: ClipWriter, picture: TappedPicture) -> None:
        raise OSError(number, "it failed")

    monkeypatch.setattr(ClipWriter, "add", fails)
    recording = stage.recording(stage.tap(stage.studio.encoded(3)))
    recording.start()
    assert ended(recording) == code
    assert "recording of 'front' ended" in caplog.text


def test_a_file_that_cannot_be_finished_is_told(
    stage: Set, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    close = ClipWriter.close

    def fails(clip: ClipWriter) -> None:
        close(clip)
        raise OSError(errno.ENOSPC, "it failed")

    monkeypatch.setattr(ClipWriter, "close", fails)
    recording = stage.recording(stage.tap(stage.studio.encoded(3)))
    recording.start()
    stage.studio.until(lambda: recording.status().pictures == 3)
    recording.wish("stop")
    assert ended(recording) == "recorder.disk_full"
    assert "it is whole up to there" in caplog.text


def test_anything_unforeseen_ends_the_recording_alone(stage: Set, caplog: pytest.LogCaptureFixture) -> None:
    broken = TappedPicture(b"\x00\x00\x01\x65garbage", 0.0, True, "h264")
    recording = stage.recording(stage.tap([broken]))
    recording.start()
    assert ended(recording) == "recorder.failed"
    assert "recording of 'front' ended" in caplog.text


def test_a_camera_that_is_away_for_thirty_seconds_is_told_and_waited_for(
    stage: Set, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(recording_module, "WAKE_S", 0.01)
    monkeypatch.setattr(recording_module, "SILENT_S", 0.05)
    pictures = stage.studio.encoded(20, key_every=10)
    tap = stage.tap(pictures[:5])
    recording = stage.recording(tap)
    recording.start()
    stage.studio.until(lambda: recording.status().state == "waiting")
    tap.give(*(replace(one, captured_at_s=one.captured_at_s + 30) for one in pictures[10:]))
    stage.studio.until(lambda: recording.status().pictures == 15)
    assert recording.status().state == "recording"
    recording.wish("stop")
    assert ended(recording) == ""
    movie = stage.movie()
    assert movie.numbers == [*range(5), *range(10, 20)]
    assert movie.times_s[5] == pytest.approx(30 + 10 / 30, abs=0.002)


def test_key_frames_are_asked_for_where_none_come(stage: Set) -> None:
    tap = stage.tap(stage.studio.encoded(91))
    recording = stage.recording(tap, limits=Limits(key_interval_s=1.0, max_seconds=91 / 30 + 0.001))
    recording.start()
    stage.studio.until(lambda: recording.status().pictures == 91)
    recording.wish("stop")
    ended(recording)
    assert tap.key_frames_asked == 3


@pytest.mark.parametrize(("key_every", "interval_s"), [(10, 1.0), (1000, 0.0)])
def test_no_key_frame_is_asked_for_where_they_come_anyway_or_nobody_wants_them(
    stage: Set, key_every: int, interval_s: float
) -> None:
    tap = stage.tap(stage.studio.encoded(60, key_every=key_every))
    recording = stage.recording(tap, limits=Limits(key_interval_s=interval_s))
    recording.start()
    stage.studio.until(lambda: recording.status().pictures == 60)
    recording.wish("stop")
    ended(recording)
    assert tap.key_frames_asked == 0


def test_what_the_taps_dropped_is_counted_over_pauses(stage: Set) -> None:
    first, second = stage.tap(stage.studio.encoded(5)), stage.tap(stage.studio.encoded(5))
    first.dropped, second.dropped = 3, 4
    recording = stage.recording(first, second)
    recording.start()
    stage.studio.until(lambda: recording.status().dropped == 3)
    recording.wish("pause")
    stage.studio.until(lambda: recording.status().state == "paused")
    recording.wish("record")
    stage.studio.until(lambda: recording.status().dropped == 7)
    recording.wish("stop")
    assert ended(recording) == ""
