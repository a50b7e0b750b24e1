"""Models what operators and the recorder say to each other: JSON, on the recorder's own channel, both ways."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import Field

from mosaic_core import Message, unit

DATA = "data"
"""The label of the recording of data among those of the cameras."""

RecordingState = Literal["starting", "recording", "waiting", "paused", "ended"]
RecorderState = Literal["idle", "recording", "paused"]


class RecorderCommand(Message):
    """A command to the recorder: `{"command": "start"}` is enough, as MOSAIC's own recorder pad sends it; its
    `timestamp` is ignored."""

    command: Literal["start", "stop", "pause", "resume", "status", "list", "delete", "snapshot"]
    labels: tuple[str, ...] = Field(
        default=(),
        max_length=64,
        description="Cameras meant, or `data`; none: all that it is configured for.",
    )
    name: str = Field(default="", max_length=200, description="`start`, `snapshot`: begins the names of the files.")
    max_seconds: float | None = Field(
        default=None, gt=0, description="`start`: end after so much.", json_schema_extra=unit("s")
    )
    max_bytes: int | None = Field(
        default=None, gt=0, description="`start`: end before the files of one are larger.", json_schema_extra=unit("B")
    )
    files: tuple[str, ...] = Field(default=(), max_length=1000, description="`delete`: names, as `list` told them.")
    send: bool = Field(default=False, description="`snapshot`: send the picture, too.")
    request_id: str = Field(default="", max_length=64, description="Comes back in the answer.")


class RecordingStatus(Message):
    """The recording of one camera, or of the data: the current one, or the last."""

    kind: Literal["camera", "data"] = "camera"
    label: str
    state: RecordingState = Field(description="`waiting`: wanted, but the camera gives no picture.")
    files: tuple[str, ...] = Field(description="Names; more than one when the picture's format changed.")
    seconds: float = Field(json_schema_extra=unit("s"), description="Without pauses.")
    bytes: int = Field(json_schema_extra=unit("B"))
    pictures: int
    messages: int = Field(default=0, description="Of data; commands that were refused are among them.")
    dropped: int = Field(description="Pictures or messages that the disk was too slow for.")
    width: int = Field(json_schema_extra=unit("px"), description="0 before the first picture, and of data.")
    height: int = Field(json_schema_extra=unit("px"))
    code: str = Field(description="Why it ended by itself; empty if somebody stopped it, or while it runs.")


class RecorderStatus(Message):
    """Pushed to everybody on every change, and every second while something is recorded."""

    type: Literal["status"] = "status"
    state: RecorderState
    labels: tuple[str, ...] = Field(description="What can be recorded: cameras, and `data`.")
    recordings: tuple[RecordingStatus, ...]
    seconds: float = Field(json_schema_extra=unit("s"), description="Of the longest one that runs.")
    bytes: int = Field(json_schema_extra=unit("B"), description="Of all in `recordings`.")
    dropped: int
    free_bytes: int | None = Field(json_schema_extra=unit("B"), description="null: the disk can't be asked.")
    code: str = Field(description="The first code in `recordings`.")


class CommandNote(Message):
    """What became of a command; in the file of data, beside the command itself."""

    schema_id: ClassVar[str] = "mosaic-recorder/Command@1"
    label: str = Field(description="Of the connector.")
    accepted: bool = Field(description="It was carried out.")
    sequence: int | None = Field(default=None, description="That of the command on its own topic, if it is there.")
    code: str = Field(description="Why it was refused; empty if it was not.")
    gate: str = Field(description="What refused it.")
    refused: str | None = Field(default=None, description="The beginning of what was refused, as text.")
    operator: str
    operator_id: str
    role: str
    session_id: str


class MovieNote(Message):
    """A place on a movie and when its picture was captured, until the next note; in the file of data."""

    schema_id: ClassVar[str] = "mosaic-recorder/Movie@1"
    label: str = Field(description="Of the camera.")
    file: str
    at_s: float = Field(json_schema_extra=unit("s"), description="A place in the file.")
    captured_at_ns: int = Field(
        json_schema_extra=unit("ns"), description="When the picture there was captured, since 1970."
    )


class FileEntry(Message):
    name: str
    label: str = Field(description="Of the camera, as it is written in the file's name.")
    bytes: int = Field(json_schema_extra=unit("B"))
    modified_at_s: float = Field(json_schema_extra=unit("s"), description="Since 1970, by the robot's wall clock.")
    is_open: bool = Field(description="It is being written: it can't be deleted.")


class FileList(Message):
    """The answer to `list` and `delete`, to whoever asked; newest first."""

    type: Literal["files"] = "files"
    request_id: str
    directory: str
    free_bytes: int | None = Field(json_schema_extra=unit("B"))
    files: tuple[FileEntry, ...]


class SnapshotTaken(Message):
    """The answer to `snapshot`, one per camera, to whoever asked."""

    type: Literal["snapshot"] = "snapshot"
    request_id: str
    label: str
    file: str = Field(default="", description="Empty where there is none; `code` says why.")
    bytes: int = Field(default=0, json_schema_extra=unit("B"))
    width: int = 0
    height: int = 0
    png_base64: str | None = Field(
        default=None, description="The file, if it was asked for and is not too large to send."
    )
    code: str = Field(default="", description="Why there is no still.")
