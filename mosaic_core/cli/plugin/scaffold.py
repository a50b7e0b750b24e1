"""Writes the package of a new plugin from templates: connectors with a device that is made up, tests and all."""

from __future__ import annotations

import json
import keyword
import re
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
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
    ``example`` is what its entry in the YAML file has beside type and label; ``more`` are the same of further
    connectors, by the module that each has, which is the ending of its type."""

    sentence: str
    example: Mapping[str, object]
    dependencies: tuple[str, ...] = ("mosaic-core>=0.1,<1", "pydantic>=2.12")
    more: Mapping[str, Mapping[str, object]] = field(default_factory=dict)
    has_widget: bool = False


KINDS = {
    "sensor": PluginKind(
        "A temperature that a sensor measures.", {"params": {"port": "/dev/ttyUSB0", "period_s": 0.5}}
    ),
    "actuator": PluginKind(
        "A motor that an operator turns.", {"params": {"port": "/dev/ttyUSB0"}, "safety": {"max_rate_hz": 50}}
    ),
    "camera": PluginKind(
        "The pictures of a camera.",
        {"params": {"width": 640, "height": 480, "fps": 20}},
        ("mosaic-core>=0.1,<1", "numpy>=1.26", "pydantic>=2.12"),
    ),
    "request": PluginKind(
        "What lies on a scale, weighed when somebody asks.", {"params": {"port": "/dev/ttyUSB0", "period_s": 0.2}}
    ),
    "full": PluginKind(
        "A joint: where it is, how fast it turns, and its mean position on request.",
        {"params": {"port": "/dev/ttyUSB0", "period_s": 0.1}},
        more={
            "speed": {"params": {"port": "/dev/ttyUSB0"}, "safety": {"max_rate_hz": 50}},
            "average": {"params": {"port": "/dev/ttyUSB0", "period_s": 0.1}},
        },
        has_widget=True,
    ),
}
"""By the name of their option."""
_NAME = re.compile(r"[a-z][a-z0-9]*(-[a-z][a-z0-9]*)*")
_MAX_NAME = 32
"""Characters: with longer ones the lines of the templates grow beyond what formatters leave alone."""
_ENDING = ".tmpl"
_WIDGETS = """
# The module {module}/widgets/{name}.js, for `widget = "{name}/Panel"`.
[project.entry-points."mosaic.widgets"]
{name} = "{module}.widgets"
"""


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

    @property
    def connector_types(self) -> tuple[str, ...]:
        return (self.connector_type, *(f"{self.connector_type}-{ending}" for ending in KINDS[self.kind].more))

    def files(self) -> Mapping[Path, str]:
        """The text of each file by its path inside the package; what the kind has takes the place of what is common."""
        parts = (files(__package__) / "templates" / part for part in ("common", self.kind))
        return dict(file for part in parts for file in self._filled(part, Path()))

    def write(self, folder: Path) -> None:
        """Write all files into ``folder``, which must not exist. Raises :class:`MosaicError` (``plugin.name``)."""
        if folder.exists():
            raise MosaicError(f"{folder} is there already", code="plugin.name")
        try:
            for path, text in self.files().items():
                (folder / path).parent.mkdir(parents=True, exist_ok=True)
                (folder / path).write_text(text, encoding="utf-8")
        except OSError as error:
            raise MosaicError(f"{folder} can't be written: {error.strerror}", code="plugin.name", cure="") from error

    def _filled(self, room: Traversable, path: Path) -> Iterator[tuple[Path, str]]:
        for entry in sorted(room.iterdir(), key=lambda one: one.name):
            if entry.is_dir():
                yield from self._filled(entry, path / (self.module if entry.name == "package" else entry.name))
            elif entry.name.endswith(_ENDING):
                name, text = (
                    Template(one).substitute(self._words())
                    for one in (entry.name.removesuffix(_ENDING), entry.read_text(encoding="utf-8"))
                )
                yield path / name, text

    def _words(self) -> dict[str, str]:
        kind = KINDS[self.kind]
        class_name = "".join(word.title() for word in self.connector_type.split("-"))
        entries = [
            {"type": type_, "label": type_.replace("-", "_"), **example}
            for type_, example in zip(self.connector_types, (kind.example, *kind.more.values()), strict=True)
        ]
        example = yaml.safe_dump(entries, sort_keys=False).rstrip()
        points = [f'{self.connector_type} = "{self.module}.connector:{class_name}Configurer"']
        for ending in kind.more:
            made_by = f"{self.module}.{ending}:{class_name}{ending.title()}Configurer"
            points.append(f'{self.connector_type}-{ending} = "{made_by}"')
        return {
            "name": self.name,
            "module": self.module,
            "type": self.connector_type,
            "class_name": class_name,
            "sentence": kind.sentence,
            "entry_points": "\n".join(points),
            "widgets": _WIDGETS.format(name=self.name, module=self.module) if kind.has_widget else "",
            "dependencies": json.dumps(kind.dependencies),
            "example": "\n".join(f"  {line}" for line in example.splitlines()),
        }
