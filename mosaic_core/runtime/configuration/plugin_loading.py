"""Imports the configurer of one plugin and checks that it keeps the contract."""

from __future__ import annotations

import importlib
import sys
from importlib.metadata import EntryPoint
from pathlib import Path
from traceback import extract_tb
from typing import Any

from mosaic_core.contract.configurer import API_VERSION, Configurer
from mosaic_core.runtime.configuration.local_connectors import LocalConnector
from mosaic_core.words.errors import PluginError

_IMPORTLIB = Path(importlib.__file__).parent


def load_configurer(entry_point: EntryPoint, source: str, local: LocalConnector | None) -> type[Configurer[Any]]:
    """Import a plugin that ``source`` ships and check that it keeps the contract; :class:`PluginError` otherwise.
    ``local``: where it stands, if it is not installed."""

    def broken(cause: str) -> PluginError:
        message = f"connector type '{entry_point.name}' of {source} can't be used: {cause}"
        code = "config.broken_plugin" if local is None else "config.broken_local"
        return PluginError(message, distribution=source, code=code)

    try:  # an import may fail in any way, even by sys.exit()
        if local is not None:
            local.prepare()
        loaded = entry_point.load()
    except (Exception, SystemExit) as error:
        explained = _explained(error) if local is None else local.explained(error)
        raise broken(explained) from error
    if not (isinstance(loaded, type) and issubclass(loaded, Configurer)):
        named = entry_point.value if local is None else f"{local.class_name}, line {local.line},"
        raise broken(f"{named} is not a Configurer class")
    version = api_version(loaded)
    if version != API_VERSION:
        raise broken(f"it is written for API version {version}, this mosaic-core speaks {API_VERSION}")
    if loaded.connector_type not in ("", entry_point.name):
        cure = f'name both alike: connector_type = "{entry_point.name}", or the entry point'
        raise broken(f"{loaded.__name__} says that its connector_type is '{loaded.connector_type}' ({cure})")
    missing = sorted(getattr(loaded, "__abstractmethods__", ()))
    if missing:
        raise broken(f"{loaded.__name__} does not implement {', '.join(missing)}")
    return loaded


def api_version(configurer: type) -> object:
    """``MOSAIC_API_VERSION`` of the configurer's module or of its top package; absent means ours."""
    for name in (configurer.__module__, configurer.__module__.partition(".")[0]):
        declared: object = getattr(sys.modules.get(name), "MOSAIC_API_VERSION", None)
        if declared is not None:
            return declared
    return API_VERSION
