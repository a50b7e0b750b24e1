"""The ``journal-tail`` connector: what services that the robot's file names write into the journal of systemd."""

from __future__ import annotations

import shutil
from collections.abc import Generator, Iterator
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field, StringConstraints

from mosaic_core.contract.configurer import DataChannelConfigurer
from mosaic_core.contract.handler import DataChannelSendable
from mosaic_core.contract.params import Params
from mosaic_core.messages import Log
from mosaic_core.words.errors import DeviceGone
from mosaic_host.logs.journal_entry import log_of
from mosaic_host.logs.log_lines import Level, LogPace, readable
from mosaic_host.running_program import SEARCH_PATH, RunningProgram
from mosaic_sensors.lines import Lines

PROGRAM = "journalctl"
MAX_COMPLAINT = 512
"""Bytes of what journalctl complains of that are kept, the last ones."""
_PRIORITIES: dict[Level, str] = {"debug": "debug", "info": "info", "warn": "warning", "error": "err", "fatal": "crit"}
Unit = Annotated[str, StringConstraints(min_length=1, max_length=255, pattern=r"^[A-Za-z0-9_@][A-Za-z0-9_@.:\\-]*$")]
"""The name of a unit. No pattern: it would let in what nobody named."""


class JournalTailParams(Params):
    units: tuple[Unit, ...] = Field(
        min_length=1, max_length=32, description="The units that operators may hear, such as ssh.service; no patterns."
    )
    source: Literal["journal", "fake"] = Field(default="journal", description="`fake`: entries that are made up.")
    level: Level = Field(default="debug", description="The least that is sent.")
    max_line_bytes: int = Field(default=16_384, ge=256, le=262_144, description="Larger entries are refused.")
    max_rate_hz: float = Field(default=50.0, gt=0, le=1000, description="What comes faster is left out, and counted.")

    @property
    def arguments(self) -> list[str]:
        """Those of journalctl."""
        fixed = ["--output=json", "--follow", "--lines=0", "--no-pager", "--quiet"]
        return [*fixed, f"--priority={_PRIORITIES[self.level]}", *(f"--unit={unit}" for unit in self.units)]


class JournalTail(DataChannelSendable[Log]):
    """Reads what ``journalctl`` follows, on the handler's own thread, and ends it when the handler ends."""

    def __init__(self, label: str, params: JournalTailParams) -> None:
        super().__init__(label)
        self.params = params
        self._pace = LogPace(self, params.max_rate_hz)

    def messages(self) -> Generator[Log, None, None]:
        """Handler's thread. Raises :class:`DeviceGone`."""
        if self.params.source == "fake":
            for tick in self.every(1.0):
                yield Log(message=f"entry {tick}, made up", name=self.params.units[0])
            return
        program = shutil.which(PROGRAM, path=SEARCH_PATH)
        if program is None:
            raise DeviceGone(f"{PROGRAM} is not here", "it comes with systemd; file-tail reads logs of other systems")
        complaint = b""
        try:
            with RunningProgram([program, *self.params.arguments]) as child:
                lines = Lines(self.params.max_line_bytes)
                while not self.is_stopping:
                    said = child.look()
                    complaint = (complaint + said.error)[-MAX_COMPLAINT:]
                    yield from self._messages_of(lines, said.out)
                    if said.is_over or (child.has_ended and not said.out and not said.error):
                        break
        except OSError as error:
            raise DeviceGone(f"{program}: {error.strerror or error}") from error
        if not self.is_stopping:
            why = readable(complaint) or "it told no reason"
            raise DeviceGone(f"{PROGRAM} ended ({child.exit_code}): {why}", "it is started again")

    def _messages_of(self, lines: Lines, piece: bytes) -> Iterator[Log]:
        before = lines.too_long
        found = lines.feed(piece)
        if lines.too_long > before:
            self._pace.refuse(f"an entry larger than {self.params.max_line_bytes} bytes", lines.too_long - before)
        for line in found:
            try:
                message = log_of(line)
            except ValueError as error:
                self._pace.refuse(error)
            else:
                if self._pace.admits(message):
                    yield message


class JournalTailConfigurer(DataChannelConfigurer[JournalTailParams]):
    """What chosen services write into the journal of systemd."""

    connector_type = "journal-tail"
    example: ClassVar[dict[str, Any] | None] = {"units": ["mosaic.service", "ssh.service"]}
    trial: ClassVar[dict[str, Any] | None] = {"units": ["mosaic.service"], "source": "fake"}

    def configure(self) -> JournalTail:
        return JournalTail(self.label, self.params)
