"""The `params` of the connector `recorder`, and where recordings go if nobody says so."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Literal

import platformdirs
from pydantic import Field, field_validator, model_validator

from mosaic_core import CameraLabel, DataLabel, OwnFolder, Params, unit
from mosaic_core.contract.media_tap import TapCodec
from mosaic_recorder.messages import DATA
from mosaic_recorder.movie_file import Container


class RecorderParams(Params):
    labels: tuple[CameraLabel, ...] = Field(
        default=(), description="Cameras that may be recorded, by their labels; a command may choose among them."
    )
    data: Literal["all"] | tuple[DataLabel, ...] = Field(
        default=(),
        description="Connectors whose messages and commands are recorded with them into an MCAP file: their labels, or "
        "`all`.",
    )
    directory: OwnFolder | None = Field(
        default=None,
        description="Folder of this recorder alone. Default: `recordings/LABEL` in MOSAIC_DATA_DIR or the user's "
        "data directory.",
    )
    container: Container = Field(
        default="mp4", description="`mp4` (H.264, plays everywhere) or `mkv` (Matroska, for either codec)."
    )
    codec: TapCodec = Field(
        default="h264", description="`vp8` (with `container: mkv`) shares the encoder of operators who watch in VP8."
    )
    max_seconds: float | None = Field(
        default=None,
        gt=0,
        description="A recording ends after so much; a command may ask for less.",
        json_schema_extra=unit("s"),
    )
    max_bytes: int | None = Field(
        default=None,
        gt=0,
        description="A recording ends before the files of one camera, or of the data, are larger; "
        "a command may ask for less.",
        json_schema_extra=unit("B"),
    )
    min_free_bytes: int = Field(
        default=500_000_000,
        ge=0,
        description="Recordings end when the disk has less than this left.",
        json_schema_extra=unit("B"),
    )
    keep_files: int | None = Field(default=None, gt=0, description="The oldest files beyond this number are deleted.")
    keep_bytes: int | None = Field(
        default=None,
        gt=0,
        description="The oldest files are deleted when all together are larger.",
        json_schema_extra=unit("B"),
    )
    key_interval_s: float = Field(
        default=10.0,
        ge=0,
        description="A key frame at least this often, so that players can jump; 0: only those that come anyway.",
        json_schema_extra=unit("s"),
    )

    @field_validator("labels")
    @classmethod
    def _distinct(cls, labels: tuple[CameraLabel, ...]) -> tuple[CameraLabel, ...]:
        if len(set(labels)) != len(labels):
            raise ValueError("each camera once")
        return labels

    @model_validator(mode="after")
    def _fits(self) -> RecorderParams:
        if not self.labels and not self.data:
            raise ValueError("name cameras in `labels`, or connectors in `data`")
        if DATA in self.labels and self.data:
            raise ValueError(f"a camera with the label '{DATA}' can't be recorded with data: it would be both")
        if self.container == "mp4" and self.codec == "vp8":
            raise ValueError("VP8 needs `container: mkv`")
        return self


def recorded(params: RecorderParams) -> tuple[str, ...]:
    """The labels of all that may be recorded: cameras, and `data`."""
    return (*params.labels, DATA) if params.data else tuple(params.labels)


def recordings_directory(params: RecorderParams, label: str) -> Path:
    """The folder of the recorder ``label``; it need not exist."""
    if params.directory is not None:
        return Path(params.directory).expanduser()
    named = os.environ.get("MOSAIC_DATA_DIR")
    data = Path(named) if named else Path(platformdirs.user_data_dir("mosaic", appauthor=False))
    return data / "recordings" / label
