"""Records one camera: from the tap into movie files, picture by picture."""

from __future__ import annotations

from collections.abc import Callable

from mosaic_core.contract.media_tap import MediaTap, TappedPicture
from mosaic_recorder.clip_writer import ClipWriter
from mosaic_recorder.messages import RecordingStatus
from mosaic_recorder.recording import WAKE_S, Limits, Recording

SILENT_S = 2.0
"""Without a picture for so long, the camera is said to be away."""


class CameraRecording(Recording[MediaTap]):
    """Records the pictures of the camera ``label``."""

    def __init__(
        self,
        label: str,
        open_tap: Callable[[], MediaTap],
        clip: ClipWriter,
        limits: Limits,
        *,
        changed: Callable[[], None] = lambda: None,
        check_disk: Callable[[], str] = lambda: "",
    ) -> None:
        super().__init__(label, open_tap, limits, changed=changed, check_disk=check_disk)
        self._clip = clip
        self._silent_s = 0.0
        self._key_asked_at_s = 0.0

    def status(self) -> RecordingStatus:
        clip = self._clip
        return RecordingStatus(
            label=self.label,
            state=self._state,
            files=tuple(clip.names),
            seconds=round(clip.seconds, 3),
            bytes=clip.size_bytes,
            pictures=clip.pictures,
            dropped=self._dropped,
            width=clip.size[0],
            height=clip.size[1],
            code=self._code,
        )

    def _cut(self) -> None:
        self._clip.pause()

    def _close(self) -> None:
        self._clip.close()

    def _record(self, tap: MediaTap) -> str:
        self._silent_s = 0.0
        code = ""
        while self._wish == "record" and not code:
            picture = tap.next(WAKE_S)
            self._dropped = self._dropped_before + tap.dropped
            if picture is None:
                code = tap.failure
                self._wait_on()
            else:
                code = self._limit_before(picture)
                if not code:
                    self._take(tap, picture)
            code = code or self._check_disk()
        return code

    def _wait_on(self) -> None:
        self._silent_s += WAKE_S
        if self._silent_s >= SILENT_S:
            self._enter("waiting")

    def _limit_before(self, picture: TappedPicture) -> str:
        """Why this picture does not belong to the recording any more."""
        limits, clip = self._limits, self._clip
        if limits.max_seconds is not None and clip.seconds_with(picture) > limits.max_seconds:
            return "recorder.max_seconds"
        if limits.max_bytes is not None and clip.size_bytes_with(picture) > limits.max_bytes:
            return "recorder.max_bytes"
        return ""

    def _take(self, tap: MediaTap, picture: TappedPicture) -> None:
        self._clip.add(picture)
        self._silent_s = 0.0
        if picture.is_key:
            self._key_asked_at_s = picture.captured_at_s
        interval_s = self._limits.key_interval_s
        if interval_s and picture.captured_at_s - self._key_asked_at_s >= interval_s:
            tap.ask_key_frame()
            self._key_asked_at_s = picture.captured_at_s
        self._enter("recording")
