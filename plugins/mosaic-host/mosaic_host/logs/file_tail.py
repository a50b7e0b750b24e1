"""The ``file-tail`` connector: lines that a program adds to its log file."""

from __future__ import annotations

from collections.abc import Generator, Iterator
from pathlib import PurePath
from typing import Any, ClassVar

from pydantic import Field, field_validator

from mosaic_core.contract.configurer import DataChannelConfigurer
from mosaic_core.contract.handler import DataChannelSendable
from mosaic_core.contract.params import Params
from mosaic_core.messages import Log
from mosaic_core.words.errors import DeviceGone
from mosaic_host.logs.growing_file import GrowingFile
from mosaic_host.logs.log_lines import MAX_NAME, LogPace, level_of, readable
from mosaic_sensors.lines import Lines

FAKE = "fake"
CURE = "it is looked for again; the robot's user must be allowed to read it"


class FileTailParams(Params):
    source: str = Field(min_length=1, max_length=4096, description="Path of the file; `fake`: lines that are made up.")
    name: str | None = Field(
        default=None, max_length=MAX_NAME, description="What speaks, as operators see it; default: the file's name."
    )
    period_s: float = Field(default=0.2, ge=0.02, le=60, description="Seconds between two looks at the file.")
    max_line_bytes: int = Field(default=4096, ge=16, le=16_384, description="Longer lines are refused.")
    max_rate_hz: float = Field(default=50.0, gt=0, le=1000, description="What comes faster is left out, and counted.")

    @field_validator("source")
    @classmethod
    def _is_absolute(cls, source: str) -> str:
        if source != FAKE and not PurePath(source).is_absolute():
            raise ValueError("no path from /; write all of it, or `fake`")
        if "\0" in source:
            raise ValueError("a path has no NUL")
        return source


class FileTail(DataChannelSendable[Log]):
    """Starts at the end of the file and sends a message per line, through rotations and truncations."""

    def __init__(self, label: str, params: FileTailParams) -> None:
        super().__init__(label)
        self.params = params
        self._name = params.name or PurePath(params.source).name[:MAX_NAME]
        self._file = GrowingFile(params.source)
        self._pace = LogPace(self, params.max_rate_hz)

    def messages(self) -> Generator[Log, None, None]:
        """Handler's thread. Raises :class:`DeviceGone`."""
        if self.params.source == FAKE:
            for tick in self.every(1.0):
                yield Log(message=f"INFO: line {tick}, made up", name=self._name)
            return
        try:
            self._file.open()
            yield from self._read_all()
        except OSError as error:
            raise DeviceGone(f"{self.params.source}: {error.strerror or error}", CURE) from error
        finally:
            self._file.close()

    def _read_all(self) -> Iterator[Log]:
        lines = Lines(self.params.max_line_bytes)
        too_long, skipped = 0, self._file.skipped_bytes
        while not self.is_stopping:
            piece = self._file.read(self.monotonic_s())
            if self._file.skipped_bytes > skipped:
                self._pace.refuse(f"{self._file.skipped_bytes - skipped} bytes came faster than they can be read")
                skipped = self._file.skipped_bytes
                lines, too_long = Lines(self.params.max_line_bytes), 0
                piece = piece.partition(b"\n")[2]  # the rest of a line whose begin was left out
            found = lines.feed(piece)
            if lines.too_long > too_long:
                self._pace.refuse(f"longer than {self.params.max_line_bytes} bytes", lines.too_long - too_long)
                too_long = lines.too_long
            yield from filter(self._pace.admits, map(self._message, found))
            if not piece and self.pause(self.params.period_s):
                return

    def _message(self, line: bytes) -> Log:
        text = readable(line)
        return Log(level=level_of(text), message=text, name=self._name)


class FileTailConfigurer(DataChannelConfigurer[FileTailParams]):
    """Lines that a program adds to its log file."""

    connector_type = "file-tail"
    example: ClassVar[dict[str, Any] | None] = {"source": "/var/log/robot.log"}
    trial: ClassVar[dict[str, Any] | None] = {"source": FAKE}

    def configure(self) -> FileTail:
        return FileTail(self.label, self.params)
