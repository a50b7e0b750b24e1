"""Imports the configurer of one plugin and checks that it keeps the contract."""

from __future__ import annotations

import sys
from collections.abc import Callable
from importlib.metadata import EntryPoint
from typing import Any

from mosaic_core.contract.configurer import API_VERSION, Configurer
from mosaic_core.contract.params import Params
from mosaic_core.runtime.configuration.local_connectors import LocalConnector
from mosaic_core.runtime.threads.code_places import explained_error, standing_at
from mosaic_core.runtime.threads.slow_code import told_when_slow
from mosaic_core.words.errors import PluginError, hint_at


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
        with told_when_slow(f"the import of connector type '{entry_point.name}' of {source}"):
            loaded = entry_point.load()
    except (Exception, SystemExit) as error:
        explained = explained_error(error) if local is None else local.explained(error)
        raise broken(_without_name(entry_point) or explained) from error
    if not (isinstance(loaded, type) and issubclass(loaded, Configurer)):
        named = entry_point.value if local is None else f"{local.class_name}, line {local.line},"
        at = standing_at(loaded) if local is None else ""
        raise broken(f"{named} is not a Configurer class{at}")
    _check(loaded, entry_point, broken)
    return loaded


def _without_name(entry_point: EntryPoint) -> str:
    """What its module has instead of the name that the entry point gives; empty where that is not what is wrong."""
    module = sys.modules.get(entry_point.module)
    if module is None or not entry_point.attr or hasattr(module, entry_point.attr.partition(".")[0]):
        return ""
    there_is = hint_at(entry_point.attr, vars(module)).removesuffix(".")
    return f"its entry point names {entry_point.attr}, which {module.__file__} does not have{there_is}"


def _check(loaded: type[Configurer[Any]], entry_point: EntryPoint, broken: Callable[[str], PluginError]) -> None:
    at = standing_at(loaded)
    version = api_version(loaded)
    if version != API_VERSION:
        raise broken(f"it is written for API version {version}, this mosaic-core speaks {API_VERSION}{at}")
    if loaded.connector_type not in ("", entry_point.name):
        cure = f'name both alike: connector_type = "{entry_point.name}", or the entry point'
        raise broken(f"{loaded.__name__} says that its connector_type is '{loaded.connector_type}' ({cure}){at}")
    missing = sorted(getattr(loaded, "__abstractmethods__", ()))
    if missing:
        raise broken(f"{loaded.__name__} does not implement {', '.join(missing)}{at}")
    model: object = loaded.params_model
    if not (isinstance(model, type) and issubclass(model, Params)):
        raise broken(f"the params_model of {loaded.__name__} is {model!r}, no subclass of Params{at}")


def api_version(configurer: type) -> object:
    """``MOSAIC_API_VERSION`` of the configurer's module or of its top package; absent means ours."""
    for name in (configurer.__module__, configurer.__module__.partition(".")[0]):
        declared: object = getattr(sys.modules.get(name), "MOSAIC_API_VERSION", None)
        if declared is not None:
            return declared
    return API_VERSION
