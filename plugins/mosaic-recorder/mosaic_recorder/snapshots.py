"""Takes stills: one picture of a camera, as it was captured where it can be had, stored as PNG in its full size."""

from __future__ import annotations

import base64
import os
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from mosaic_core.contract.media_tap import MediaTap, PictureTap, TappedImage, TappedPicture
from mosaic_core.machines.delivery.reassembly import MAX_MESSAGE_BYTES
from mosaic_recorder.disk_watch import code_of
from mosaic_recorder.folder import RecordingsFolder, new_file
from mosaic_recorder.messages import RecorderCommand, SnapshotTaken
from mosaic_recorder.stills import decoded, framed, png_of

if TYPE_CHECKING:
    import av

PATIENCE_S = 8.0
"""For a camera that must be opened first; some need five seconds."""
WAKE_S = 0.2
ENVELOPE_BYTES = 1024
"""What an answer has beside the picture."""


class Snapshots:
    """Takes the stills of one recorder; each :meth:`take` on a thread of its own. ``is_over``: the robot stops."""

    def __init__(self, folder: RecordingsFolder, min_free_bytes: int, is_over: Callable[[], bool]) -> None:
        self._folder = folder
        self._min_free_bytes = min_free_bytes
        self._is_over = is_over

    def take(self, label: str, taps: Iterable[PictureTap | MediaTap], command: RecorderCommand) -> SnapshotTaken:
        """The answer, also where there is no picture. ``taps`` of one camera, the best first: another one is opened
        where the one before can't give pictures. Raises nothing that a camera or a disk can cause."""
        try:
            if self._folder.free_bytes() < self._min_free_bytes:
                return _failed(label, command, "recorder.disk_full")
            frame = self._frame(taps)
            if isinstance(frame, str):
                return _failed(label, command, frame)
            png = png_of(frame)
            path = self._store(label, command.name, png)
        except OSError as error:
            return _failed(label, command, code_of(error))
        except ValueError:
            return _failed(label, command, "recorder.no_picture")
        answer = SnapshotTaken(
            request_id=command.request_id,
            label=label,
            file=path.name,
            bytes=len(png),
            width=frame.width,
            height=frame.height,
        )
        return _with_picture(answer, png) if command.send else answer

    def _frame(self, taps: Iterable[PictureTap | MediaTap]) -> av.VideoFrame | str:
        """A whole picture, or the code why there is none."""
        code = "recorder.no_picture"
        for tap in taps:
            picture = self._picture(tap)
            if not isinstance(picture, str):
                return framed(picture) if isinstance(picture, TappedImage) else decoded(picture)
            code = picture
            if not code.startswith("media."):
                break
        return code

    def _picture(self, tap: PictureTap | MediaTap) -> TappedImage | TappedPicture | str:
        """The first picture, which is complete by itself; or the code why there is none."""
        waited_s = 0.0
        with tap:
            while waited_s < PATIENCE_S and not self._is_over():
                picture = tap.next(WAKE_S)
                if picture is not None:
                    return picture
                if tap.failure:
                    return tap.failure
                waited_s += WAKE_S
        return "recorder.no_picture"

    def _store(self, label: str, name: str, png: bytes) -> Path:
        """Under its name only when it is complete."""
        path = self._folder.claim(name or "snapshot", label, "png")
        draft = path.with_suffix(".part")
        try:
            with new_file(draft) as file:
                file.write(png)
                file.flush()
                os.fsync(file.fileno())
            draft.replace(path)
        finally:
            draft.unlink(missing_ok=True)
            self._folder.release(path)
        self._folder.tidy()
        return path


def _failed(label: str, command: RecorderCommand, code: str) -> SnapshotTaken:
    return SnapshotTaken(request_id=command.request_id, label=label, code=code)


def _with_picture(answer: SnapshotTaken, png: bytes) -> SnapshotTaken:
    """With the file, unless it is too large to travel: it then stays on the robot alone."""
    encoded = base64.b64encode(png).decode()
    if len(encoded) + ENVELOPE_BYTES > MAX_MESSAGE_BYTES:
        return answer
    return answer.model_copy(update={"png_base64": encoded})
