"""Looks up definitions: bundled ones, those of files and folders that a robot's YAML names, and those of a ROS
installation on this machine.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from pathlib import Path

from mosaic_core.words.errors import hint_at, slip_of
from mosaic_ros2.definitions.bundled import bundled
from mosaic_ros2.definitions.definition import Definition, DefinitionError, full_name
from mosaic_ros2.definitions.msg_text import read_action, read_message, read_service

MAX_FILE_BYTES = 256 * 1024
_PARTS = {
    "srv": ("_Request", "_Response"),
    "action": (
        "_SendGoal_Request", "_SendGoal_Response", "_GetResult_Request", "_GetResult_Response", "_FeedbackMessage",
        "_Goal", "_Result", "_Feedback",
    ),
}  # fmt: skip
"""What ROS makes of one file, the longer endings first."""


def installed_shares() -> tuple[Path, ...]:
    """The ``share`` folders of the ROS installation that this shell has sourced, if any."""
    prefixes = [one for one in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep) if one]
    return tuple(Path(prefix) / "share" for prefix in prefixes)


class TypeBook:
    """Finds a definition by its name. Any thread; a file is read once, when it is first asked for.

    ``places``: ``.msg``, ``.srv`` and ``.action`` files in ``package/msg/`` folders, or folders above such: a package,
    or a ``share`` folder. They win over what is bundled, which wins over a ROS installation. ``distribution``: of ROS,
    ``humble`` say, where a few messages had other fields.
    """

    def __init__(
        self, places: Iterable[str | Path] = (), distribution: str = "", shares: Iterable[Path] | None = None
    ) -> None:
        self._places = tuple(Path(place) for place in places)
        self._shares = installed_shares() if shares is None else tuple(shares)
        self._bundled = bundled(distribution)
        self._found: dict[str, Definition | None] = {}

    def add(self, *definitions: Definition) -> None:
        """Take what was learnt elsewhere, from a publisher's type object say."""
        self._found |= {one.name: one for one in definitions}

    def knows(self, name: str) -> bool:
        """Whether the message and everything in it is defined."""
        try:
            self.closure(name)
        except DefinitionError:
            return False
        return True

    def is_slip(self, name: str) -> bool:
        """Whether an unknown message is almost called like one of the same package that is bundled."""
        package, _, own = full_name(name).rpartition("/")
        beside = {one.rpartition("/")[2] for one in self._bundled if one.rpartition("/")[0] == package}
        return slip_of(own, beside) is not None

    def find(self, name: str) -> Definition:
        """The definition of this message. Raises :class:`DefinitionError`."""
        name = full_name(name)
        if name not in self._found:
            found = self._read(name, self._places) or self._bundled.get(name) or self._read(name, self._shares)
            self._found[name] = found
        definition = self._found[name]
        if definition is None:
            file = _file_of(name)
            raise DefinitionError(
                f"nobody has defined {file}{hint_at(file, map(_file_of, self._bundled))} Name its "
                f".{file.split('/')[1]} file or the folder of its package in `definitions`, or start the robot in a "
                "shell that has sourced ROS."
            )
        return definition

    def closure(self, name: str) -> dict[str, Definition]:
        """The definition of this message and of all messages in it, by name. Raises :class:`DefinitionError`, also
        for a message that contains itself."""
        found: dict[str, Definition] = {}
        self._collect(full_name(name), found, ())
        return found

    def _collect(self, name: str, found: dict[str, Definition], above: tuple[str, ...]) -> None:
        if name in above:
            raise DefinitionError(f"{name} contains itself, by way of {' and '.join(above)}")
        if name in found:
            return
        definition = self.find(name)
        for inner in definition.messages_in_it():
            self._collect(inner, found, (*above, name))
        found[name] = definition

    def _read(self, name: str, places: Iterable[Path]) -> Definition | None:
        package, kind, base = _file_of(name).split("/")
        for path in _candidates(places, package, kind, base):
            if path.is_file() and path.stat().st_size <= MAX_FILE_BYTES:
                found = _definitions_of(f"{package}/{kind}/{base}", path)
                self._found |= {one.name: one for one in found}
                return next((one for one in found if one.name == name), None)
        return None


def _file_of(name: str) -> str:
    """The type as people write it: that of the file from which ROS makes this message."""
    endings = _PARTS.get(name.split("/")[1], ())
    return next((name.removesuffix(end) for end in endings if name.endswith(end)), name)


def _candidates(places: Iterable[Path], package: str, kind: str, base: str) -> Iterator[Path]:
    file = f"{base}.{kind}"
    for place in places:
        if place.suffix == f".{kind}":
            if place.name == file and place.parent.parent.name in (package, ""):
                yield place
        else:
            yield place / package / kind / file
            if place.resolve().name == package:
                yield place / kind / file


def _definitions_of(name: str, path: Path) -> tuple[Definition, ...]:
    try:
        text = path.read_text(encoding="utf-8")
        if path.suffix == ".msg":
            return (read_message(name, text),)
        return read_service(name, text) if path.suffix == ".srv" else read_action(name, text)
    except (OSError, ValueError) as error:
        raise DefinitionError(f"{path}: {error}") from None
