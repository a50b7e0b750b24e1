"""Records the data of a robot: from the tap into an MCAP file, message by message."""

from __future__ import annotations

import time
from collections.abc import Callable

from mosaic_core.contract.data_tap import DataTap, TappedMessage
from mosaic_recorder.data.data_writer import DataWriter
from mosaic_recorder.data.movie_log import MovieStretch
from mosaic_recorder.messages import DATA, RecordingStatus
from mosaic_recorder.recording import WAKE_S, Limits, Recording

FLUSH_S = 1.0
"""So much a crash may cost."""


class DataRecording(Recording[DataTap]):
    """Records what connectors send and are told. ``stretches``: what is new of the movies beside it."""

    def __init__(
        self,
        open_tap: Callable[[], DataTap],
        writer: DataWriter,
        limits: Limits,
        *,
        stretches: Callable[[], list[MovieStretch]] = list,
        changed: Callable[[], None] = lambda: None,
        check_disk: Callable[[], str] = lambda: "",
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        super().__init__(DATA, open_tap, limits, changed=changed, check_disk=check_disk)
        self._writer = writer
        self._stretches = stretches
        self._clock = clock
        self._seconds = 0.0
        self._flush_at_s = 0.0

    def status(self) -> RecordingStatus:
        writer = self._writer
        return RecordingStatus(
            kind="data",
            label=self.label,
            state=self._state,
            files=tuple(writer.names),
            seconds=round(self._seconds, 3),
            bytes=writer.size_bytes,
            pictures=0,
            messages=writer.messages,
            dropped=self._dropped,
            width=0,
            height=0,
            code=self._code,
        )

    def _cut(self) -> None:
        self._writer.flush()

    def _close(self) -> None:
        self._writer.close()

    def _record(self, tap: DataTap) -> str:
        self._writer.open(tap.channels)
        self._enter("recording")
        begun_s, before_s = self._clock(), self._seconds
        code = ""
        while self._wish == "record" and not code:
            message = tap.next(WAKE_S)
            self._dropped = self._dropped_before + tap.dropped
            self._seconds = before_s + self._clock() - begun_s
            code = self._limit_before(message) or (tap.failure if message is None else "")
            if not code:
                self._take(message)
                code = self._check_disk()
        return code

    def _limit_before(self, message: TappedMessage | None) -> str:
        """Why what comes now does not belong to the recording any more."""
        limits = self._limits
        if limits.max_seconds is not None and self._seconds >= limits.max_seconds:
            self._seconds = limits.max_seconds
            return "recorder.max_seconds"
        if message is None or limits.max_bytes is None:
            return ""
        return "recorder.max_bytes" if self._writer.size_bytes_with(message) > limits.max_bytes else ""

    def _take(self, message: TappedMessage | None) -> None:
        for stretch in self._stretches():
            self._writer.note(stretch, self._clock())
        if message is not None:
            self._writer.add(message)
        if self._clock() >= self._flush_at_s:
            self._writer.flush()
            self._flush_at_s = self._clock() + FLUSH_S
