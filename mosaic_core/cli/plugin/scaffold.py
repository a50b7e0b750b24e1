"""Writes the package of a new plugin from templates: connectors with a device that is made up, tests and all."""

from __future__ import annotations

import ast
import builtins
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
_STAND_IN = "StandIn"
"""In place of a name of classes; nothing in the templates begins so."""
_OF_TESTS = frozenset({"tests", "conftest", "test_connector", "test_speed", "test_average", "test_widget"})
"""Modules that a new plugin has beside its package; pytest imports them by these names."""
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
        if not _is_name(self.name):
            cure = (
                "use words of small letters and digits that begin with a letter, joined by -, at most "
                f"{_MAX_NAME} characters, such as {_like(self.name)}"
            )
            raise MosaicError(f"{self.name!r} is no name for a plugin", code="plugin.name", cure=cure)
        if self.module in _OF_TESTS:
            message, cure = f"'{self.module}' is the name of its own tests", f"choose another, such as acme-{self.name}"
            raise MosaicError(message, code="plugin.name", cure=cure)
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

    @property
    def class_name(self) -> str:
        """What its classes begin with: a name that, with their endings, hides nothing that its modules use."""
        plain = "".join(word.title() for word in self.connector_type.split("-"))
        texts = self._files(_STAND_IN).items()
        nodes = [node for path, text in texts if path.suffix == ".py" for node in ast.walk(ast.parse(text))]
        names = {name for node in nodes if (name := _name_in(node))}
        own = {name for name in names if name.startswith(_STAND_IN)}
        taken = {*(names - own), *dir(builtins), *keyword.kwlist}
        is_taken = any(name.replace(_STAND_IN, plain) in taken for name in own)
        return f"{plain}Connector" if is_taken else plain

    def files(self) -> Mapping[Path, str]:
        """The text of each file by its path inside the package; what the kind has takes the place of what is common."""
        return self._files(self.class_name)

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

    def _files(self, class_name: str) -> Mapping[Path, str]:
        words = self._words(class_name)
        parts = (files(__package__) / "templates" / part for part in ("common", self.kind))
        return dict(file for part in parts for file in self._filled(part, Path(), words))

    def _filled(self, room: Traversable, path: Path, words: Mapping[str, str]) -> Iterator[tuple[Path, str]]:
        for entry in sorted(room.iterdir(), key=lambda one: one.name):
            if entry.is_dir():
                inner = path / (self.module if entry.name == "package" else entry.name)
                yield from self._filled(entry, inner, words)
            elif entry.name.endswith(_ENDING):
                name, text = (
                    Template(one).substitute(words)
                    for one in (entry.name.removesuffix(_ENDING), entry.read_text(encoding="utf-8"))
                )
                yield path / name, text

    def _words(self, class_name: str) -> dict[str, str]:
        kind = KINDS[self.kind]
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


def _is_name(word: str) -> bool:
    return _NAME.fullmatch(word) is not None and len(word) <= _MAX_NAME


def _like(word: str) -> str:
    """A name that can be, as near to ``word`` as that goes."""
    joined = re.sub("[^a-z0-9]+", "-", word.lower()).strip("-")
    found = re.sub("-(?=[0-9])", "", joined)
    return found if _is_name(found) else "acme-thermometer"


def _name_in(node: ast.AST) -> str:
    """What a node of a module's tree names there; empty where it names nothing."""
    match node:
        case ast.Name(id=name) | ast.ClassDef(name=name) | ast.alias(asname=None, name=name) | ast.alias(asname=name):
            return name or ""
    return ""
