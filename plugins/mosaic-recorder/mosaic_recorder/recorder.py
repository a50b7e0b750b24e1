"""The connector `recorder`: commands and news on its own channel; the work is done by the desk and its threads."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import ClassVar

from mosaic_core import DataChannelBidirectional, DataChannelConfigurer, Refused, Sender
from mosaic_core.contract.host import HandlerHost
from mosaic_recorder.desk import RecorderDesk
from mosaic_recorder.disk_watch import code_of
from mosaic_recorder.folder import RecordingsFolder
from mosaic_recorder.messages import RecorderCommand
from mosaic_recorder.params import RecorderParams, recordings_directory


class Recorder(DataChannelBidirectional[RecorderCommand]):
    """The handler of a `recorder` connector. It never waits for a camera or for the end of a recording: what takes time
    is told by a status or an answer.
    """

    widget: ClassVar[str | None] = "recorder"

    def __init__(self, label: str, desk: RecorderDesk) -> None:
        super().__init__(label)
        self._desk = desk
        desk.tap = self.tap_media
        desk.tap_pictures = self.tap_pictures
        desk.tap_data = self.tap_data
        desk.told = self.send_json

    def bind(self, host: HandlerHost) -> None:
        super().bind(host)
        self._desk.wake()  # from here on there is somebody to tell

    def handle_data(self, data: RecorderCommand, sender: Sender) -> None:
        try:
            self._carry_out(data, sender)
        except OSError as error:
            raise Refused(code_of(error), str(error)) from error

    def _carry_out(self, data: RecorderCommand, sender: Sender) -> None:
        desk = self._desk
        match data.command:
            case "start":
                desk.start_recordings(data)
            case "stop":
                desk.end_recordings(data)
            case "pause":
                desk.pause_recordings(data)
            case "resume":
                desk.resume_recordings(data)
            case "list":
                self.send_json(desk.listed(data), to=sender)
            case "delete":
                self.send_json(desk.delete_files(data), to=sender)
            case "snapshot":
                desk.take_snapshots(data, lambda taken: self.send_json(taken, to=sender))
            case "status":
                self.send_json(desk.status(), to=sender)


class RecorderConfigurer(DataChannelConfigurer[RecorderParams]):
    """Records cameras into MP4 or Matroska files without encoding them again and data into MCAP files; takes stills."""

    connector_type = "recorder"
    example = {"labels": ["front"], "keep_bytes": 20_000_000_000}  # noqa: RUF012 - as the contract has it

    trial = {"labels": ["front"], "directory": str(Path(tempfile.gettempdir(), "mosaic-recorder-trial"))}  # noqa: RUF012

    def configure(self) -> Recorder:
        params = self.params
        directory = recordings_directory(params, self.label)
        desk = self.shared.get(
            f"mosaic-recorder:{self.label}",
            lambda: RecorderDesk(params, RecordingsFolder(directory, params.keep_files, params.keep_bytes), self.label),
        )
        return Recorder(self.label, desk)
