"""Reads what ``mosaic demo --with PATH`` names: a plugin's folder, or one file of connectors. Runs none of its code."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from mosaic_core.runtime.configuration.config_env import masked
from mosaic_core.runtime.configuration.local_connectors import FOLDER, connectors_in
from mosaic_core.runtime.configuration.resolver import GROUP
from mosaic_core.runtime.configuration.yaml_document import Place, YamlDocument, read_yaml
from mosaic_core.words.errors import ConfigError, slip_of
from mosaic_sim.demo.errors import DemoFailed

CONFIG = "mosaic_config.yaml"
Entry = dict[str, Any]
"""One of ``connectors:`` in a YAML file, its references to the environment masked."""


@dataclass(frozen=True, slots=True)
class OwnEntry:
    """One connector of a plugin, and where its own YAML file has it, if it does."""

    entry: Entry
    document: YamlDocument | None = None
    place: Place = ()

    def line_of(self, below: Place) -> str:
        """File and line of what stands ``below`` it, or of the nearest thing around; empty where no file names it."""
        if self.document is None:
            return ""
        told = self.document.problem((*self.place, *below), "")
        return f"{told.file}:{told.line}"


@dataclass(frozen=True, slots=True)
class OwnPlugin:
    """A plugin that nobody need install: the robot of the demo finds it by what stands here."""

    name: str
    version: str
    path: Path
    """As it was named."""
    entry_points: Mapping[str, Mapping[str, str]]
    entries: tuple[OwnEntry, ...]
    """Its connectors as its own YAML file has them; those the file does not name, with a label alone."""
    import_from: Path | None = None
    """What belongs on the robot's ``PYTHONPATH``."""
    modules: Mapping[str, str] | None = None
    """Modules to be written for it, by name."""

    @property
    def source(self) -> str:
        """As errors about connectors name it."""
        return f"{self.name} {self.version}".strip()

    @property
    def types(self) -> tuple[str, ...]:
        """The connector types that it offers."""
        return tuple(self.entry_points[GROUP])


def plugin_at(path: Path) -> OwnPlugin:
    """The plugin that ``path`` names; raises :class:`DemoFailed` if there is none."""
    if path.is_dir():
        return _distribution(path)
    if path.suffix == ".py" and path.is_file():
        return _single_file(path)
    cure = "name the folder of a plugin, such as `--with .`, or a file with connectors, such as connectors/lamp.py"
    raise DemoFailed(f"--with {path}: " + ("it is no Python file" if path.exists() else "it does not exist"), cure)


def _distribution(folder: Path) -> OwnPlugin:
    project = _project(folder)
    entry_points = project.get("entry-points", {})
    if not entry_points.get(GROUP):
        cure = f'name its connectors in [project.entry-points."{GROUP}"], such as lamp = "acme_lamp:LampConfigurer"'
        raise DemoFailed(f"{folder / 'pyproject.toml'} offers no connector", cure)
    entries = _entries(folder / CONFIG, entry_points[GROUP])
    top = {value.partition(":")[0].partition(".")[0].strip() for value in entry_points[GROUP].values()}
    homes = [home for home in (folder, folder / "src") if any(_has(home, module) for module in top)]
    # Without such a folder it may be installed, and nothing need be done.
    import_from = homes[0].resolve() if homes else None
    version = str(project.get("version", ""))
    return OwnPlugin(str(project.get("name", folder.name)), version, folder, entry_points, entries, import_from)


def _has(home: Path, module: str) -> bool:
    return (home / module).is_dir() or (home / f"{module}.py").is_file()


def _project(folder: Path) -> dict[str, Any]:
    file = folder / "pyproject.toml"
    try:
        return dict(tomllib.loads(file.read_text("utf-8")).get("project", {}))
    except FileNotFoundError:
        cure = "name the folder that has it, or a single file, such as connectors/lamp.py"
        raise DemoFailed(f"{folder} has no pyproject.toml: it is no plugin", cure) from None
    except (OSError, ValueError) as error:
        raise DemoFailed(f"{file} can't be read: {error}", "mend it") from None


def _single_file(file: Path) -> OwnPlugin:
    found = connectors_in(file)
    if not found.connectors or any(one.unreadable for one in found.connectors):
        told = "; ".join(f"{file}:{one.line}: {one.message}" for one in found.problems)
        cures = "; ".join(dict.fromkeys(one.cure for one in found.problems))
        cure = "write a DataChannelConfigurer or MediaTrackConfigurer with a connector_type into it"
        raise DemoFailed(told or f"{file} offers no connector", cures or cure)
    points = {one.type: one.entry_point.value for one in found.connectors}
    folder = found.connectors[0].file.parent
    package = next(iter(points.values())).partition(".")[0]
    beside = folder.parent if folder.name == FOLDER else folder
    entries = _entries(beside / CONFIG, points)
    modules = {package: f'"""The folder that a file of --with stands in."""\n\n__path__ = [{str(folder)!r}]\n'}
    return OwnPlugin(file.name, "", file, {GROUP: points}, entries, modules=modules)


def _entries(config: Path, types: Mapping[str, str]) -> tuple[OwnEntry, ...]:
    """The entries of these types in the plugin's own YAML file, and one without params for every other type."""
    document = _document(config) if config.is_file() else None
    listed = document.tree.get("connectors") if document else None
    every = [(place, one) for place, one in enumerate(listed or ()) if isinstance(one, dict)]
    entries = []
    for place, one in every:
        kind = str(one.get("type", ""))
        found = OwnEntry(_labelled(one), document, ("connectors", place))
        if kind in types:
            entries.append(found)
        elif meant := slip_of(kind, types):  # what is less alike, another plugin offers
            where = found.line_of(("type",))
            raise DemoFailed(f"{where}: the connector type '{kind}' is none of this plugin's", f"write {meant}")
    named = {one.entry["type"] for one in entries}
    return (*entries, *(OwnEntry(_labelled({"type": one})) for one in types if one not in named))


def _labelled(entry: Entry) -> Entry:
    return {**entry, "label": str(entry.get("label") or str(entry.get("type", "")).replace("-", "_"))}


def _document(config: Path) -> YamlDocument:
    """References to the environment stay masked: it is the robot that reads them."""
    try:
        lines = read_yaml(config, {}).lines
        tree = yaml.safe_load(masked(config.read_text("utf-8-sig")))
    except (ConfigError, yaml.YAMLError) as error:
        told = str(error) if isinstance(error, ConfigError) else f"{config} can't be read: {error}"
        raise DemoFailed(told, "mend it, or take it away: params then have defaults") from None
    return YamlDocument(tree, str(config), lines)
