"""Throw-away distributions: plugins that are installed for one test."""

from __future__ import annotations

import importlib
import os
import sys
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType


def write_distribution(
    folder: Path,
    name: str,
    *,
    version: str = "1.0.0",
    modules: Mapping[str, str] | None = None,
    entry_points: Mapping[str, Mapping[str, str]] | None = None,
    metadata: Mapping[str, str] | None = None,
    description: str = "",
) -> Path:
    """Write a distribution into ``folder``, which belongs on ``sys.path``; returns its ``dist-info`` folder.

    ``modules`` maps module names to their source, ``entry_points`` groups to ``{name: "module:object"}``,
    ``metadata`` further fields of core metadata to their text; ``description`` is the readme.
    """
    for module, source in (modules or {}).items():
        path = folder.joinpath(*module.split(".")).with_suffix(".py")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(source)
    info = folder / f"{name.replace('-', '_')}-{version}.dist-info"
    info.mkdir(parents=True)
    fields = {"Metadata-Version": "2.1", "Name": name, "Version": version, **(metadata or {})}
    head = "".join(f"{field}: {text}\n" for field, text in fields.items())
    (info / "METADATA").write_text(f"{head}\n{description}" if description else head)
    lines = [
        line
        for group, points in (entry_points or {}).items()
        for line in (f"[{group}]", *(f"{point} = {target}" for point, target in points.items()), "")
    ]
    (info / "entry_points.txt").write_text("\n".join(lines))
    importlib.invalidate_caches()
    return info


def forget_modules_of(folder: Path) -> None:
    """Let the next test import its own modules of the same name."""
    within = f"{folder}{os.sep}"  # as text: a process may have thousands of modules
    inner = {folder.name, *(path.name for path in folder.rglob("*"))}
    for name, module in list(sys.modules.items()):
        file = getattr(module, "__file__", None)
        if file.startswith(within) if file else name.rpartition(".")[2] in inner and _lies_within(module, within):
            del sys.modules[name]


def _lies_within(module: ModuleType, folder: str) -> bool:
    """Of a package without an ``__init__.py``, which has no file and may lie in several places: whether all do. To ask
    for them looks them up, on all of ``sys.path``."""
    places = [*map(str, getattr(module, "__path__", ()))]
    return bool(places) and all(f"{place}{os.sep}".startswith(folder) for place in places)
