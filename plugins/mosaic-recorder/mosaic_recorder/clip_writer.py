"""Pictures of one camera, file after file: a new one where the format of the picture changes, the time line goes on.

A picture is written when the next one comes: only then is it known how long it is shown.
"""

from __future__ import annotations

from collections.abc import Callable
from datetime import datetime
from pathlib import Path

from mosaic_core.contract.media_tap import TappedPicture
from mosaic_recorder.bitstream import parameters_of, profile_of
from mosaic_recorder.movie_file import Container, MovieFile
from mosaic_recorder.stills import decoded
from mosaic_recorder.timeline import Timeline

FILE_OVERHEAD_BYTES = 2048
PICTURE_OVERHEAD_BYTES = 32
"""What a container adds at most, measured with fragments of a second; for `max_bytes` before it is written."""


class ClipWriter:
    """Writes the pictures of one recording into files, on one thread; any may read its figures. ``claim`` gives the
    path of a new file, ``release`` is told when it is finished, ``begun`` of each stretch without a cut: file, where it
    begins there, and when that was captured. ``wall``: the wall time of a capture. Raises :class:`OSError`.
    """

    def __init__(
        self,
        container: Container,
        claim: Callable[[], Path],
        release: Callable[[Path], None],
        title: str = "",
        *,
        begun: Callable[[str, float, float], object] = lambda file, at_s, captured_at_s: None,
        wall: Callable[[float], datetime | None] = lambda captured_at_s: None,
    ) -> None:
        self._container: Container = container
        self._title = title
        self._claim = claim
        self._release = release
        self._begun = begun
        self._wall = wall
        self._timeline = Timeline()
        self._parameters = b""
        self._format: tuple[object, ...] = ()
        self._file: MovieFile | None = None
        self._file_begins_s = 0.0
        self._held: tuple[TappedPicture, float] | None = None
        self.names: list[str] = []
        self.pictures = 0
        self.size_bytes = 0
        """At most what the files take, container and all."""
        self.size = (0, 0)

    @property
    def seconds(self) -> float:
        return self._timeline.end_s

    def seconds_with(self, picture: TappedPicture) -> float:
        """How long the recording would be with ``picture``."""
        return self._timeline.end_with(picture.captured_at_s)

    def size_bytes_with(self, picture: TappedPicture) -> int:
        return self.size_bytes + len(picture.data) + PICTURE_OVERHEAD_BYTES + FILE_OVERHEAD_BYTES

    def add(self, picture: TappedPicture) -> None:
        """The next picture; the first one, and the first after :meth:`pause`, is a key frame."""
        is_cut, file = self._timeline.is_cut, self._file
        at_s = self._timeline.place(picture.captured_at_s)
        self._write_held(at_s)
        if picture.is_key:
            self._fit(picture, at_s)
        if self._file is not None and (is_cut or self._file is not file):
            self._begun(self._file.path.name, at_s - self._file_begins_s, picture.captured_at_s)
        self._held = (picture, at_s)
        self.size_bytes += len(picture.data) + PICTURE_OVERHEAD_BYTES
        self.pictures += 1

    def pause(self) -> None:
        """Nothing comes for a while, and the time line leaves it out."""
        self._write_held(self._timeline.end_s)
        self._timeline.cut()

    def close(self) -> None:
        """Finish the file, if there is one."""
        try:
            self._write_held(self._timeline.end_s)
        finally:
            self._close_file()

    def _fit(self, key: TappedPicture, at_s: float) -> None:
        """A file that takes pictures like ``key``."""
        parameters = parameters_of(key)
        if self._file is not None and parameters == self._parameters:
            return
        shown = decoded(key)
        picture_format = (profile_of(key), shown.width, shown.height, shown.format.name)
        self._parameters = parameters
        if self._file is not None and picture_format == self._format:
            return
        self._close_file()
        path = self._claim()
        try:
            self._file = MovieFile(
                path,
                self._container,
                key.codec,
                shown.width,
                shown.height,
                self._title,
                self._wall(key.captured_at_s),
            )
        except BaseException:
            self._release(path)
            raise
        self._format, self._file_begins_s, self.size = picture_format, at_s, (shown.width, shown.height)
        self.names.append(path.name)
        self.size_bytes += FILE_OVERHEAD_BYTES

    def _write_held(self, until_s: float) -> None:
        if self._held is None:
            return
        (picture, at_s), self._held = self._held, None
        assert self._file is not None, "a recording begins with a key frame"
        self._file.write(picture.data, at_s - self._file_begins_s, until_s - at_s, is_key=picture.is_key)

    def _close_file(self) -> None:
        if self._file is None:
            return
        file, self._file = self._file, None
        try:
            file.close()
        finally:
            self._release(file.path)
