"""Reads the files that tell what the frames of a bus mean."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from importlib.resources import files

import cantools.database
from cantools.database.can import Database
from cantools.database.can import Message as Described
from cantools.database.errors import Error, UnsupportedDatabaseFormatError

from mosaic_core.words.errors import MosaicError, hint_at, whole_sentence

SAMPLE = "sample"
FrameKey = tuple[int, bool]
"""The id of a frame, and whether it has 29 bits."""


class CanDatabase:
    """The messages that some files describe, by name and by id. Raises :class:`MosaicError` (``config.invalid``) for a
    file that can't be read, and for two that describe the same frame."""

    def __init__(self, names: Iterable[str]) -> None:
        self.by_name: dict[str, Described] = {}
        self.by_key: dict[FrameKey, Described] = {}
        for name in names:
            for message in _read(name).messages:
                self._add(message, name)

    def _add(self, message: Described, file: str) -> None:
        key = (message.frame_id, message.is_extended_frame)
        if message.name in self.by_name or key in self.by_key:
            raise invalid(f"{file} describes {message.name} ({message.frame_id:#x}) a second time", "Name one file.")
        self.by_name[message.name] = self.by_key[key] = message

    def named(self, names: Iterable[str]) -> Mapping[str, Described]:
        """These of its messages; all of them where none is named. Raises :class:`MosaicError`."""
        found = {name: self.message(name) for name in names} or self.by_name
        if not found:
            raise invalid("nothing tells what the frames mean", "Name a DBC file: dbc: robot.dbc.")
        return found

    def message(self, name: str) -> Described:
        if name not in self.by_name:
            raise invalid(f"the DBC file has no message {name!r}{hint_at(name, self.by_name)}", "Name one that it has.")
        return self.by_name[name]


def invalid(message: str, cure: str) -> MosaicError:
    """A mistake of the robot's file, which only another file can show."""
    return MosaicError(f"{whole_sentence(message)} {cure}", code="config.invalid", cure=cure)


def _read(name: str) -> Database:
    try:
        if name == SAMPLE:
            text = files("mosaic_can").joinpath("sample.dbc").read_text(encoding="utf-8")
            found = cantools.database.load_string(text, "dbc")
        else:
            found = cantools.database.load_file(name)
    except (OSError, ValueError, LookupError, Error, UnsupportedDatabaseFormatError) as error:
        raise invalid(f"{name} can't be read: {error}", "Give a file that cantools reads, such as DBC.") from error
    if not isinstance(found, Database):
        raise invalid(f"{name} describes a diagnosis, and no bus", "Give a DBC, KCD, SYM or ARXML file.")
    return found
