"""Records one camera, on a thread of its own: from the tap into files, until somebody stops it or a limit does."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from mosaic_core.contract.media_tap import MediaTap, TappedPicture
from mosaic_recorder.clip_writer import ClipWriter
from mosaic_recorder.disk_watch import code_of
from mosaic_recorder.messages import RecordingState, RecordingStatus

logger = logging.getLogger(__name__)

WAKE_S = 0.2
"""How long a picture is waited for before commands are looked at."""
SILENT_S = 2.0
"""Without a picture for so long, the camera is said to be away."""

Wish = Literal["record", "pause", "stop"]
OpenTap = Callable[[], MediaTap]


@dataclass(frozen=True, slots=True)
class Limits:
    """The limits at which a recording ends by itself. ``key_interval_s`` 0: no key frame is asked for."""

    max_seconds: float | None = None
    max_bytes: int | None = None
    key_interval_s: float = 0.0


class Recording:
    """Commands and :meth:`status` from any thread, none of them waits; ``changed`` is called on the recording's own.

    ``check_disk`` is called now and then and says why the disk takes no more, or nothing.
    """

    def __init__(
        self,
        label: str,
        open_tap: OpenTap,
        clip: ClipWriter,
        limits: Limits,
        *,
        changed: Callable[[], None] = lambda: None,
        check_disk: Callable[[], str] = lambda: "",
    ) -> None:
        self.label = label
        self._open_tap = open_tap
        self._clip = clip
        self._limits = limits
        self._changed = changed
        self._check_disk = check_disk
        self._wishes = threading.Condition()
        self._wish: Wish = "record"
        self._state: RecordingState = "starting"
        self._code = ""
        self._dropped = self._dropped_before = 0
        self._silent_s = 0.0
        self._key_asked_at_s = 0.0
        self._thread = threading.Thread(target=self.run, name=f"mosaic-recording-{label}", daemon=True)

    # -- any thread ----------------------------------------------------------------------------------------------

    def start(self) -> None:
        self._thread.start()

    def wish(self, wish: Wish) -> None:
        """From now on; a recording that was stopped stays so."""
        with self._wishes:
            if self._wish != "stop":
                self._wish = wish
                self._wishes.notify_all()

    @property
    def wanted(self) -> Wish:
        return self._wish

    @property
    def is_running(self) -> bool:
        """It records, waits or pauses, and nobody stopped it."""
        return self._wish != "stop" and self._state != "ended"

    @property
    def has_ended(self) -> bool:
        return self._state == "ended"

    def join(self, timeout_s: float) -> bool:
        """Wait for the end of a stopped recording; whether it came."""
        if self._thread.ident is not None:
            self._thread.join(timeout_s)
        return not self._thread.is_alive()

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

    # -- its own thread ------------------------------------------------------------------------------------------

    def run(self) -> None:
        """All of it. Raises nothing: the robot goes on whatever the disk does."""
        code = ""
        try:
            code = self._live()
        except OSError as error:
            code = code_of(error)
            logger.warning("recording of %r ended: %s (%s)", self.label, error, code)
        except Exception:
            code = "recorder.failed"
            logger.exception("recording of %r ended", self.label)
        self._end(code)

    def _end(self, code: str) -> None:
        try:
            self._clip.close()
        except OSError as error:
            code = code or code_of(error)
            logger.warning("the file of %r could not be finished: %s; it plays up to there", self.label, error)
        self._code = code
        self._enter("ended")

    def _live(self) -> str:
        while self._wish != "stop":
            with self._open_tap() as tap:
                code = self._record(tap)
            if code:
                return code
            self._clip.pause()
            self._rest()
        return ""

    def _rest(self) -> None:
        """Sleep through a pause; the camera may, too."""
        if self._wish == "pause":
            self._enter("paused")
        with self._wishes:
            self._wishes.wait_for(lambda: self._wish != "pause")

    def _record(self, tap: MediaTap) -> str:
        """Until another wish, or a reason to end."""
        self._enter("starting")
        self._silent_s, self._dropped_before = 0.0, self._dropped
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

    def _enter(self, state: RecordingState) -> None:
        if state != self._state:
            self._state = state
            self._changed()
