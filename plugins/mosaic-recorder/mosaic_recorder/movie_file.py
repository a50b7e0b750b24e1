"""One file of a recording: encoded pictures go in as they are, and what is on the disk can be played at any time.

MP4 is written in fragments and Matroska in clusters of a second; each is complete by itself, so that a crash or a
power cut costs the last one at most.
"""

from __future__ import annotations

import errno
from datetime import UTC, datetime
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

from mosaic_core.contract.media_tap import TapCodec
from mosaic_recorder.disk_file import DiskFile

if TYPE_CHECKING:
    from av.container.output import OutputContainer
    from av.stream import Stream

Container: TypeAlias = Literal["mp4", "mkv"]

TICKS_PER_S = 90_000
_FORMATS: dict[Container, str] = {"mp4": "mp4", "mkv": "matroska"}
_OPTIONS: dict[Container, dict[str, str]] = {
    "mp4": {"movflags": "frag_keyframe+empty_moov+default_base_moof", "frag_duration": "1000000"},
    "mkv": {"cluster_time_limit": "1000"},
}


class MovieFile:
    """Writes one file of a recording, from one thread. Raises :class:`OSError` when the disk does not take it; close it
    then, too.
    """

    def __init__(
        self,
        path: Path,
        container: Container,
        codec: TapCodec,
        width: int,
        height: int,
        title: str = "",
        begins_at: datetime | None = None,
    ) -> None:
        """``begins_at``: when its first picture was captured."""
        import av

        self.path = path
        self._failures = av.FFmpegError
        self._disk = DiskFile(path)
        options = {**_OPTIONS[container], "flush_packets": "1"}
        try:
            self._output: OutputContainer = av.open(
                self._disk, "w", format=_FORMATS[container], container_options=options
            )
            self._stream: Stream = self._output.add_mux_stream(codec, width=width, height=height)
        except BaseException:
            self._disk.close()
            raise
        self._stream.time_base = Fraction(1, TICKS_PER_S)
        begins = (begins_at or datetime.now(UTC)).isoformat()  # MP4 keeps the seconds of it alone, but for a comment
        self._output.metadata.update({"title": title, "creation_time": begins, "comment": f"first picture at {begins}"})

    def write(self, data: bytes, at_s: float, duration_s: float, *, is_key: bool) -> None:
        """Add one picture at ``at_s`` of this file. H.264 comes with start codes; the file gets what it needs."""
        import av

        packet: av.Packet[Any] = av.Packet(data)
        packet.stream = self._stream
        packet.time_base = Fraction(1, TICKS_PER_S)
        packet.pts = packet.dts = round(at_s * TICKS_PER_S)
        packet.duration = round(duration_s * TICKS_PER_S)
        packet.is_keyframe = is_key
        self._disk.mark_whole()  # libav hands over whole fragments, within one call
        try:
            self._output.mux(packet)
        except self._failures as error:
            raise self._disk.failure or OSError(errno.EIO, f"{self.path.name}: {error}") from error
        self._disk.sync_now_and_then()

    def close(self) -> None:
        """Finish the file, unless the disk has failed already. Raises :class:`OSError`; what was written stays
        playable."""
        had_failed = self._disk.failure is not None
        self._disk.mark_whole()
        try:
            self._output.close()
        except (OSError, self._failures) as error:
            if not had_failed:
                raise self._disk.failure or OSError(errno.EIO, f"{self.path.name}: {error}") from error
        finally:
            self._disk.close()
