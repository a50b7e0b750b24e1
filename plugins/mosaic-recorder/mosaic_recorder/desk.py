"""Decides what one recorder does: what is recorded, the answers to commands, and the news for everybody.

It lives as long as the robot: when that stops, every file is finished. Handlers come and go with their tap and voice.
"""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, Self

from mosaic_core import Refused
from mosaic_core.contract.media_tap import MediaTap, PictureTap, TapCodec
from mosaic_recorder.folder import RecordingsFolder
from mosaic_recorder.messages import (
    DATA,
    FileEntry,
    FileList,
    RecorderCommand,
    RecorderStatus,
    SnapshotTaken,
)
from mosaic_recorder.new_recordings import NewRecordings, OpenTap, TapData, TapPictures
from mosaic_recorder.params import RecorderParams, recorded
from mosaic_recorder.recording import Recording
from mosaic_recorder.snapshots import Snapshots

logger = logging.getLogger(__name__)

STATUS_PERIOD_S = 1.0
END_PATIENCE_S = 1.2
"""For finishing the files when the robot stops; it has two seconds for everything."""
STILL_CODECS: tuple[TapCodec, ...] = ("h264", "vp8")
"""Of a camera that encodes by itself. H.264 first: libvpx makes its first picture 4 dB worse, and needs half a second
to catch up."""
MAX_SNAPSHOTS = 4
"""At once; each is a thread and a decoder."""


class RecorderDesk:
    """Commands come from one thread at a time; The taps and ``told`` are set before the first. Commands raise
    :class:`Refused`, and :class:`OSError` where the folder can't be used."""

    def __init__(self, params: RecorderParams, folder: RecordingsFolder, label: str = "recorder") -> None:
        self._params = params
        self._labels = recorded(params)
        self._new = NewRecordings(label, params, folder, self.wake)
        self._folder = folder
        self._recordings: dict[str, Recording[Any]] = {}
        self._ending: list[Recording[Any]] = []
        self._news = threading.Condition()
        self._has_news = False
        self._is_over = False
        self._teller = threading.Thread(target=self._tell, name="mosaic-recorder-status", daemon=True)
        self._snapshots = Snapshots(folder, params.min_free_bytes, lambda: self._is_over)
        self._snapshot_slots = threading.BoundedSemaphore(MAX_SNAPSHOTS)
        self.tap: OpenTap
        self.tap_pictures: TapPictures
        self.tap_data: TapData
        self.told: Callable[[RecorderStatus], object] = lambda status: None
        """Called with every status, on the desk's own thread."""

    def __enter__(self) -> Self:
        self._teller.start()
        return self

    def __exit__(self, *_: object) -> None:
        with self._news:
            self._is_over = True
            self._news.notify_all()
        recordings = [*self._ending, *self._recordings.values()]
        for recording in recordings:
            recording.wish("stop")
        deadline_s = time.monotonic() + END_PATIENCE_S
        for recording in recordings:
            if not recording.join(max(0.0, deadline_s - time.monotonic())):
                logger.warning("the disk holds the recording of %r up; it plays up to there", recording.label)
        self._teller.join(max(0.0, deadline_s - time.monotonic()))

    # -- commands ------------------------------------------------------------------------------------------------

    def start_recordings(self, command: RecorderCommand) -> None:
        """Begin the cameras that aren't recorded yet. Raises :class:`Refused`."""
        labels = [label for label in self._meant(command) if not self._runs(label)]
        if not labels:
            raise Refused("recorder.already_recording")
        free_bytes = self._folder.free_bytes()
        if free_bytes < self._params.min_free_bytes:
            raise Refused("recorder.disk_full", f"{free_bytes} bytes are free, {self._params.min_free_bytes} stay so")
        self._ending = [recording for recording in self._ending if not recording.has_ended]
        for label in labels:
            if label in self._recordings:
                self._ending.append(self._recordings[label])
            self._recordings = {**self._recordings, label: self._made(label, command)}
            self._recordings[label].start()
        self.wake()

    def end_recordings(self, command: RecorderCommand) -> None:
        for recording in self._running(command):
            recording.wish("stop")

    def pause_recordings(self, command: RecorderCommand) -> None:
        for recording in self._running(command):
            recording.wish("pause")

    def resume_recordings(self, command: RecorderCommand) -> None:
        for recording in self._running(command):
            recording.wish("record")

    def listed(self, command: RecorderCommand) -> FileList:
        return FileList(
            request_id=command.request_id,
            directory=str(self._folder.path),
            free_bytes=self._free_bytes(),
            files=tuple(
                FileEntry(
                    name=file.name,
                    label=file.label,
                    bytes=file.size_bytes,
                    modified_at_s=file.modified_at_ns / 1e9,
                    is_open=self._folder.is_in_use(file.name),
                )
                for file in self._folder.files()
            ),
        )

    def delete_files(self, command: RecorderCommand) -> FileList:
        """What is left. Raises :class:`Refused` for files that aren't there or are being written; the others go."""
        refused = self._folder.delete(command.files)
        self.wake()
        in_use = [name for name in refused if self._folder.is_in_use(name)]
        if refused:
            code = "recorder.file_in_use" if in_use else "recorder.unknown_file"
            raise Refused(code, ", ".join((in_use or refused)[:3]))
        return self.listed(command)

    def take_snapshots(self, command: RecorderCommand, answer: Callable[[SnapshotTaken], object]) -> None:
        """One per camera meant; ``answer`` is called on other threads. Raises :class:`Refused`."""
        for label in self._meant(command, self._params.labels):
            if not self._snapshot_slots.acquire(blocking=False):
                raise Refused("recorder.busy", f"{MAX_SNAPSHOTS} snapshots are being taken")
            threading.Thread(
                target=self._snap, args=(label, command, answer), name=f"mosaic-snapshot-{label}", daemon=True
            ).start()

    # -- news ----------------------------------------------------------------------------------------------------

    def wake(self) -> None:
        """Something changed: everybody is told soon. Any thread."""
        with self._news:
            self._has_news = True
            self._news.notify_all()

    def status(self) -> RecorderStatus:
        """Any thread."""
        recordings = list(self._recordings.values())
        rows = tuple(recording.status() for recording in recordings)
        running = [recording for recording in recordings if recording.is_running]
        is_paused = bool(running) and all(recording.wanted == "pause" for recording in running)
        return RecorderStatus(
            state="idle" if not running else "paused" if is_paused else "recording",
            labels=self._labels,
            recordings=rows,
            seconds=max((recording.status().seconds for recording in running), default=0.0),
            bytes=sum(row.bytes for row in rows),
            dropped=sum(row.dropped for row in rows),
            free_bytes=self._free_bytes(),
            code=next((row.code for row in rows if row.code), ""),
        )

    def _tell(self) -> None:
        while not self._is_over:
            self.told(self.status())
            with self._news:
                is_live = any(recording.is_running for recording in self._recordings.values())
                self._news.wait_for(lambda: self._has_news or self._is_over, STATUS_PERIOD_S if is_live else None)
                self._has_news = False

    # -- inside --------------------------------------------------------------------------------------------------

    def _meant(self, command: RecorderCommand, known: Sequence[str] | None = None) -> Iterable[str]:
        known = self._labels if known is None else known
        unknown = [label for label in command.labels if label not in known]
        if unknown:
            raise Refused("recorder.unknown_camera", f"{unknown[0]!r}; known: {', '.join(known)}")
        return dict.fromkeys(command.labels or known)

    def _running(self, command: RecorderCommand) -> list[Recording[Any]]:
        found = [self._recordings[label] for label in self._meant(command) if self._runs(label)]
        if not found:
            raise Refused("recorder.not_recording")
        return found

    def _runs(self, label: str) -> bool:
        return label in self._recordings and self._recordings[label].is_running

    def _made(self, label: str, command: RecorderCommand) -> Recording[Any]:
        if label == DATA and self._params.data:
            return self._new.of_data(self.tap_data, command)
        return self._new.of_camera(label, self.tap, command)

    def _snap(self, label: str, command: RecorderCommand, answer: Callable[[SnapshotTaken], object]) -> None:
        try:
            answer(self._snapshots.take(label, self._best_taps(label), command))
        finally:
            self._snapshot_slots.release()
        self.wake()

    def _best_taps(self, label: str) -> Iterator[PictureTap | MediaTap]:
        yield self.tap_pictures(label)
        for codec in STILL_CODECS:
            yield self.tap(label, codec)

    def _free_bytes(self) -> int | None:
        try:
            return self._folder.free_bytes()
        except OSError:
            return None
