"""Finds what is to be examined: a distribution that is installed, or the folder of one, with its metadata, its code and
its connector types."""

from __future__ import annotations

import json
import sys
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from importlib.machinery import PathFinder
from importlib.metadata import Distribution, EntryPoint, distributions
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit

from mosaic_core.runtime.configuration.resolver import GROUP, ConnectorResolver
from mosaic_core.runtime.widgets import widget_modules
from mosaic_core.words.errors import MosaicError, guess

MAX_FILES = 400
"""Of one kind, of one distribution: a folder may hold more than a plugin."""


@dataclass(frozen=True, slots=True)
class Shipment:
    """One distribution under examination. ``tree``: the folder with its sources, where there is one; ``metadata``: what
    it says of itself, by the names of core metadata; ``wheel``: the text of its ``WHEEL``."""

    name: str
    version: str
    entry_points: tuple[EntryPoint, ...]
    metadata: Mapping[str, tuple[str, ...]]
    tree: Path | None = None
    wheel: str = ""
    widgets: tuple[EntryPoint, ...] = ()
    """The modules of widgets that a source tree names; those of what is installed are found like any other's."""
    only: frozenset[str] = field(default_factory=frozenset)
    """The connector types that were asked for; none: all."""

    @property
    def source(self) -> str:
        return f"{self.name} {self.version}".strip()

    def is_called(self, distribution: str) -> bool:
        """Whether it is this distribution, in whatever version and spelling."""
        return _normal(distribution) == _normal(self.name)

    @property
    def metadata_file(self) -> str:
        """Where its author says what it is."""
        return str(self.tree / "pyproject.toml") if self.tree is not None else self.source

    def connectors(self) -> tuple[EntryPoint, ...]:
        """Those to examine, by type."""
        return tuple(one for one in self.entry_points if not self.only or one.name in self.only)

    def packages(self) -> tuple[str, ...]:
        """The top packages that its connectors come from."""
        sound = (one for one in self.entry_points if one.pattern.match(one.value))
        return tuple(dict.fromkeys(one.module.partition(".")[0] for one in sound))

    def folders(self) -> Iterator[Path]:
        """Where the code of those packages lies; of a module that stands alone, nothing. Imports nothing."""
        for package in self.packages():
            spec = PathFinder.find_spec(package)
            locations = spec.submodule_search_locations if spec is not None else None
            yield from (Path(one) for one in locations or ())

    def code(self) -> list[Path]:
        """Its Python files."""
        found = [file for folder in self.folders() for file in sorted(folder.rglob("*.py"))]
        for package in self.packages():
            spec = PathFinder.find_spec(package)
            if spec is not None and spec.submodule_search_locations is None and spec.origin:
                found.append(Path(spec.origin))
        return found[:MAX_FILES]

    def tests(self) -> list[Path] | None:
        """The Python files of its tests; ``None`` where no source tree is at hand."""
        if self.tree is None:
            return None
        folders = [self.tree / "tests", self.tree / "test"]
        return [file for folder in folders for file in sorted(folder.rglob("*.py"))][:MAX_FILES]

    def pages(self) -> list[tuple[str, str]]:
        """``(file, text)`` of its README and its documentation; of an installed one, the long description."""
        if self.tree is None:
            return [("README", text) for text in self.metadata.get("Description", ())]
        files = [*self.tree.glob("README*"), *sorted(self.tree.glob("docs/**/*.md"))][:MAX_FILES]
        return [(str(file), file.read_text("utf-8", errors="replace")) for file in files if file.is_file()]


def found_shipments(words: Iterable[str]) -> list[Shipment]:
    """Those that ``words`` name, each a distribution, a folder or a connector type; without words the one of this
    folder, else every one that is installed. Raises :class:`MosaicError` (``plugin.not_found``)."""
    named, known = list(words), _installed()
    if not named:
        here = Path.cwd()
        return [_of_folder(here, known)] if _declares_connectors(here) else [*known.values()]
    found = dict[str, Shipment]()
    for word in named:
        one = _named(word, known)
        before = found.get(one.name)
        only = one.only | before.only if before is not None and before.only and one.only else one.only
        found[one.name] = replace(one, only=frozenset(only))
    return [*found.values()]


def _named(word: str, known: Mapping[str, Shipment]) -> Shipment:
    if Path(word).is_dir() and ("/" in word or word.startswith(".") or _normal(word) not in known):
        return _of_folder(Path(word).resolve(), known)
    if _normal(word) in known:
        return known[_normal(word)]
    for one in known.values():
        if any(point.name == word for point in one.entry_points):
            return replace(one, only=frozenset({word}))
    types = [one.type for one in ConnectorResolver().types()]
    cure = guess(
        word, [*known, *types], "`mosaic connectors list` shows what is installed; a folder is named by its path"
    )
    raise MosaicError(f"no distribution, folder or connector type '{word}'", code="plugin.not_found", cure=cure)


def _installed() -> dict[str, Shipment]:
    """Every installed distribution with connectors, by its name; imports none."""
    found: dict[str, Shipment] = {}
    for one in distributions():
        points = tuple(point for point in one.entry_points if point.group == GROUP)
        if not points:
            continue
        told = one.metadata  # which is read anew each time that it is asked for, with the long description
        name = told["Name"]
        if name and _normal(name) not in found:
            metadata = {key: tuple(map(str, told.get_all(key) or ())) for key in dict.fromkeys(told)}
            wheel = one.read_text("WHEEL") or ""
            found[_normal(name)] = Shipment(name, told["Version"] or "", points, metadata, _tree_of(one), wheel)
    return dict(sorted(found.items()))


def _tree_of(one: Distribution) -> Path | None:
    """The folder that an editable installation points to."""
    try:
        told = json.loads(one.read_text("direct_url.json") or "{}")
    except ValueError:
        return None
    url = urlsplit(str(told.get("url", "")))
    folder = Path(unquote(url.path))
    return folder if told.get("dir_info", {}).get("editable") and url.scheme == "file" and folder.is_dir() else None


def _of_folder(folder: Path, known: Mapping[str, Shipment]) -> Shipment:
    """A source tree: as it is installed, or else made importable for this process."""
    project = _project_of(folder)
    name = str(project.get("name", folder.name))
    installed = known.get(_normal(name))
    if installed is not None and installed.tree is not None and installed.tree.samefile(folder):
        return installed
    points, widgets = _entry_points(project, GROUP), _entry_points(project, widget_modules.GROUP)
    if not points:
        message = f"{folder} names no connectors"
        cure = f'its pyproject.toml lacks [project.entry-points."{GROUP}"], or has no connectors in it'
        raise MosaicError(message, code="plugin.not_found", cure=cure)
    for path in (folder, folder / "src"):
        if path.is_dir() and str(path) not in sys.path:
            sys.path.insert(0, str(path))
    metadata = _metadata_of(project, folder)
    return Shipment(name, str(project.get("version", "")), points, metadata, folder, widgets=widgets)


def _entry_points(project: Mapping[str, Any], group: str) -> tuple[EntryPoint, ...]:
    named = project.get("entry-points", {}).get(group, {})
    return tuple(EntryPoint(str(one), str(value), group) for one, value in named.items())


def _project_of(folder: Path) -> dict[str, Any]:
    file = folder / "pyproject.toml"
    try:
        project = tomllib.loads(file.read_text("utf-8")).get("project", {})
    except FileNotFoundError:
        message = f"{folder} has no pyproject.toml"
        raise MosaicError(message, code="plugin.not_found", cure="name the folder of a plugin") from None
    except (OSError, ValueError) as error:
        raise MosaicError(f"{file} can't be read: {error}", code="plugin.not_found", cure="mend it") from None
    return project if isinstance(project, dict) else {}


def _declares_connectors(folder: Path) -> bool:
    try:
        return GROUP in (folder / "pyproject.toml").read_text("utf-8", errors="replace")
    except OSError:
        return False


def _metadata_of(project: Mapping[str, Any], folder: Path) -> dict[str, tuple[str, ...]]:
    """What a build would write into the core metadata, as far as the ladder asks for it."""
    licence, readme = project.get("license"), project.get("readme")
    text = licence if isinstance(licence, str) else (licence or {}).get("text") or (licence or {}).get("file")
    file = readme if isinstance(readme, str) else (readme or {}).get("file", "")
    description = folder / file if file else None
    told = {
        "License-Expression": text,
        "Requires-Python": project.get("requires-python"),
        "Description": description.read_text("utf-8") if description is not None and description.is_file() else None,
    }
    classifiers = tuple(str(one) for one in project.get("classifiers", ()))
    requires = tuple(str(one) for one in project.get("dependencies", ()))
    lists = {"Classifier": classifiers, "Requires-Dist": requires}
    return {key: (str(value),) for key, value in told.items() if value} | lists


def _normal(name: str) -> str:
    return name.lower().replace("_", "-").replace(".", "-")
