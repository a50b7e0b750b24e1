"""Writes the package of a new plugin from templates: one connector with a device that is made up, tests and all."""

from __future__ import annotations

import json
import keyword
import re
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from importlib.resources import files
from importlib.resources.abc import Traversable
from importlib.util import find_spec
from pathlib import Path
from string import Template

import yaml

from mosaic_core.words.errors import MosaicError


@dataclass(frozen=True, slots=True)
class PluginKind:
    """A kind of plugin: the folder of ``templates`` that is called like it, and what the common templates say of it.
    ``example`` is what its entry in the YAML file has beside type and label."""

    sentence: str
    example: Mapping[str, object]
    dependencies: tuple[str, ...] = ("mosaic-core>=0.1,<1", "pydantic>=2.9")


KINDS = {
    "sensor": PluginKind(
        "A temperature that a sensor measures.", {"params": {"port": "/dev/ttyUSB0", "period_s": 0.5}}
    ),
    "actuator": PluginKind(
        "A motor that an operator turns.", {"params": {"port": "/dev/ttyUSB0"}, "safety": {"timeout_s": 0.3}}
    ),
    "camera": PluginKind(
        "The pictures of a camera.",
        {"params": {"width": 640, "height": 480, "fps": 20}},
        ("mosaic-core>=0.1,<1", "numpy>=1.26", "pydantic>=2.9"),
    ),
}
"""By the name of their option."""
_NAME = re.compile(r"[a-z][a-z0-9]*(-[a-z][a-z0-9]*)*")
_MAX_NAME = 32
"""Characters: with longer ones the lines of the templates grow beyond what formatters leave alone."""
_ENDING = ".tmpl"


@dataclass(frozen=True, slots=True)
class NewPlugin:
    """A plugin that is to be written; ``kind`` is a key of :data:`KINDS`. Raises :class:`MosaicError`
    (``plugin.name``) for a name that can't be."""

    name: str
    kind: str

    def __post_init__(self) -> None:
        if not _NAME.fullmatch(self.name) or len(self.name) > _MAX_NAME:
            cure = "use words of small letters and digits, joined by -, at most 32 characters, such as acme-thermometer"
            raise MosaicError(f"{self.name!r} is no name for a plugin", code="plugin.name", cure=cure)
        if keyword.iskeyword(self.module) or self.module in sys.stdlib_module_names or find_spec(self.module):
            cure = f"choose another, such as acme-{self.name}"
            raise MosaicError(f"a module '{self.module}' is there already", code="plugin.name", cure=cure)

    @property
    def module(self) -> str:
        return self.name.replace("-", "_")

    @property
    def connector_type(self) -> str:
        return self.name.removeprefix("mosaic-")

    def files(self) -> Iterator[tuple[Path, str]]:
        """Each file's path inside the package, and its text."""
        for part in ("common", self.kind):
            yield from self._filled(files(__package__) / "templates" / part, Path())

    def write(self, folder: Path) -> None:
        """Write all files into ``folder``, which must not exist. Raises :class:`MosaicError` (``plugin.name``)."""
        if folder.exists():
            raise MosaicError(f"{folder} is there already", code="plugin.name")
        try:
            for path, text in self.files():
                (folder / path).parent.mkdir(parents=True, exist_ok=True)
                (folder / path).write_text(text, encoding="utf-8")
        except OSError as error:
            raise MosaicError(f"{folder} can't be written: {error.strerror}", code="plugin.name", cure="") from error

    def _filled(self, room: Traversable, path: Path) -> Iterator[tuple[Path, str]]:
        for entry in sorted(room.iterdir(), key=lambda one: one.name):
            if entry.is_dir():
                yield from self._filled(entry, path / (self.module if entry.name == "package" else entry.name))
            elif entry.name.endswith(_ENDING):
                text = Template(entry.read_text(encoding="utf-8")).substitute(self._words())
                yield path / entry.name.removesuffix(_ENDING), text

    def _words(self) -> dict[str, str]:
        kind = KINDS[self.kind]
        label = self.connector_type.replace("-", "_")
        entry = {"type": self.connector_type, "label": label, **kind.example}
        example = yaml.safe_dump([entry], sort_keys=False).rstrip()
        return {
            "name": self.name,
            "module": self.module,
            "type": self.connector_type,
            "class_name": "".join(word.title() for word in self.connector_type.split("-")),
            "sentence": kind.sentence,
            "dependencies": json.dumps(kind.dependencies),
            "example": "\n".join(f"  {line}" for line in example.splitlines()),
        }
