"""Makes the recordings of one recorder: where their files go, what ends them, and one clock for all."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, TypeVar

from mosaic_core.contract.data_tap import DataTap
from mosaic_core.contract.media_tap import MediaTap, PictureTap, TapCodec
from mosaic_recorder.camera_recording import CameraRecording
from mosaic_recorder.clip_writer import ClipWriter
from mosaic_recorder.data.data_recording import DataRecording
from mosaic_recorder.data.data_writer import DataWriter
from mosaic_recorder.data.movie_log import MovieLog, MovieStretch
from mosaic_recorder.disk_watch import DiskWatch
from mosaic_recorder.folder import RecordingsFolder
from mosaic_recorder.messages import DATA, RecorderCommand
from mosaic_recorder.params import RecorderParams
from mosaic_recorder.recording import Limits
from mosaic_recorder.robot_clock import RobotClock

OpenTap = Callable[[str, TapCodec], MediaTap]
TapPictures = Callable[[str], PictureTap]
TapData = Callable[..., DataTap]
Number = TypeVar("Number", int, float)


class NewRecordings:
    """Makes recordings that are not started yet. ``changed``: called by each of them on its own thread."""

    def __init__(
        self, recorder: str, params: RecorderParams, folder: RecordingsFolder, changed: Callable[[], None]
    ) -> None:
        self._recorder = recorder
        self._params = params
        self._folder = folder
        self._changed = changed
        self._movies = MovieLog()
        self._clock = RobotClock()

    def of_camera(self, label: str, tap: OpenTap, command: RecorderCommand) -> CameraRecording:
        params = self._params
        clip = ClipWriter(
            params.container,
            lambda: self._folder.claim(command.name, label, params.container),
            self._folder.release,
            label,
            begun=lambda *stretch: self._movies.add(MovieStretch(label, *stretch)),
            wall=self._clock.wall,
        )
        return CameraRecording(
            label, lambda: tap(label, params.codec), clip, self._limits(command), **self._surroundings()
        )

    def of_data(self, tap: TapData, command: RecorderCommand) -> DataRecording:
        labels = () if self._params.data == "all" else self._params.data
        claim = functools.partial(self._folder.claim, command.name, DATA, "mcap")
        return DataRecording(
            lambda: tap(*labels),
            DataWriter(self._recorder, claim, self._folder.release, self._clock),
            self._limits(command),
            stretches=self._movies.reader(self._folder.is_in_use),
            **self._surroundings(),
        )

    def _surroundings(self) -> dict[str, Any]:
        return {
            "changed": self._changed,
            "check_disk": DiskWatch(self._folder, self._params.min_free_bytes).check,
        }

    def _limits(self, command: RecorderCommand) -> Limits:
        params = self._params
        return Limits(
            _less(params.max_seconds, command.max_seconds),
            _less(params.max_bytes, command.max_bytes),
            params.key_interval_s,
        )


def _less(configured: Number | None, asked: Number | None) -> Number | None:
    """A command may ask for less than the robot allows, never for more."""
    known = [limit for limit in (configured, asked) if limit is not None]
    return min(known, default=None)
