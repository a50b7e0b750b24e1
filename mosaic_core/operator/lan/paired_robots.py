"""Keeps the robots that this machine is paired with: one file each, for its owner alone."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Annotated
from uuid import UUID

import platformdirs
from pydantic import AfterValidator, Field, ValidationError

from mosaic_core.adapters.lan.robot_certificate import LARGEST_CERTIFICATE
from mosaic_core.machines.lan.announced_robots import LONGEST_NAME
from mosaic_core.words.errors import MosaicError, SignalingError, nearest
from mosaic_core.words.wire_model import PlainText, WireModel, wrong_fields

_LARGEST_FILE = 64 * 1024
LONGEST_TOKEN = 4096
ACCESS_TOKEN = r"^[\w-]+\.[\w-]+\.[\w-]+$"  # noqa: S105 - the form of a JWT


class PairedRobot(WireModel):
    """A robot, its sign-in for this machine, and how it was last reached. ``certificate``: the one it must present, as
    PEM; empty over http and where an authority vouches for it."""

    robot_id: Annotated[str, AfterValidator(lambda text: str(UUID(text)))]
    name: PlainText = Field(max_length=LONGEST_NAME)
    url: str = Field(max_length=300, pattern=r"^https?://")
    access_token: str = Field(max_length=LONGEST_TOKEN, pattern=ACCESS_TOKEN, repr=False)
    certificate: str = Field(default="", max_length=LARGEST_CERTIFICATE)


class PairedRobots:
    """The paired robots in one directory, by their ids. Every call reads or writes files."""

    def __init__(self, directory: Path | None = None) -> None:
        self.directory = directory or _data_dir() / "paired"

    def all(self) -> list[PairedRobot]:
        """By name. Raises :class:`MosaicError` (``lan.unreadable``) for a file that can't be used."""
        try:
            files = sorted(self.directory.glob("*.json"))
        except OSError as error:
            raise _unusable(self.directory, error) from error
        return sorted(map(_read, files), key=lambda one: (one.name, one.robot_id))

    def of_id(self, robot_id: str) -> PairedRobot | None:
        return next((one for one in self.all() if one.robot_id == robot_id), None)

    def named(self, wanted: str) -> PairedRobot:
        """The one of this id, name or address; :class:`SignalingError` (``lan.not_paired``, ``lan.several``) names the
        nearest, or all."""
        robots = self.all()
        ways: tuple[Callable[[PairedRobot], bool], ...] = (
            lambda one: one.robot_id == wanted.lower(),
            lambda one: one.name == wanted,
            lambda one: one.url == wanted or one.url.partition("://")[2] == wanted,
        )
        matching: list[PairedRobot] = next((found for way in ways if (found := [*filter(way, robots)])), [])
        if len(matching) == 1:
            return matching[0]
        if matching:
            which = ", ".join(f"{one.robot_id} at {one.url}" for one in matching)
            message = f"{len(matching)} paired robots are called {wanted!r}: {which}"
            raise SignalingError(message, code="lan.several")
        meant = nearest(wanted, (one.name for one in robots))
        message = f"this machine is not paired with a robot {wanted!r}"
        if meant is None:
            raise SignalingError(f"{message}.", code="lan.not_paired")
        cure = "Use that name; `mosaic operator robots --lan` lists them all."
        raise SignalingError(f"{message}; did you mean {meant!r}?", code="lan.not_paired", cure=cure)

    def keep(self, robot: PairedRobot) -> None:
        """In place of what was kept under its id. Raises :class:`MosaicError` (``lan.unreadable``)."""
        try:
            self.directory.mkdir(mode=0o700, parents=True, exist_ok=True)
            self.directory.chmod(0o700)
            _write_private(self._file(robot.robot_id), robot.model_dump_json(by_alias=True, indent=2))
        except OSError as error:
            raise _unusable(self.directory, error) from error

    def forget(self, robot_id: str) -> None:
        self._file(robot_id).unlink(missing_ok=True)

    def _file(self, robot_id: str) -> Path:
        return self.directory / f"{robot_id}.json"


def _data_dir() -> Path:
    named = os.environ.get("MOSAIC_DATA_DIR")
    return Path(named) if named else platformdirs.user_data_path("mosaic", appauthor=False)


def _read(file: Path) -> PairedRobot:
    try:
        if file.stat().st_size > _LARGEST_FILE:
            raise OSError(f"it is larger than {_LARGEST_FILE} bytes")
        return PairedRobot.model_validate_json(file.read_text(encoding="utf-8"))
    except ValidationError as error:
        message = f"{file} holds no paired robot: {wrong_fields(error)}"
        raise MosaicError(message, code="lan.unreadable") from None  # the cause quotes what may be the token
    except (OSError, ValueError) as error:
        raise _unusable(file, error) from error


def _unusable(place: Path, error: Exception) -> MosaicError:
    return MosaicError(f"{place} can't be used: {error}", code="lan.unreadable")


def _write_private(file: Path, text: str) -> None:
    """Complete or not at all, and for nobody else."""
    draft = file.with_name(f".{file.name}.{os.getpid()}")
    descriptor = os.open(draft, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_CLOEXEC, 0o600)
    with os.fdopen(descriptor, "w", encoding="utf-8") as stream:
        stream.write(text + "\n")
    draft.replace(file)
