"""Imports the configurer of one plugin and checks that it keeps the contract."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any

from mosaic_core.contract.configurer import API_VERSION, Configurer
from mosaic_core.words.errors import PluginError

if TYPE_CHECKING:
    from mosaic_core.runtime.configuration.resolver import InstalledConnector


def load_configurer(found: InstalledConnector) -> type[Configurer[Any]]:
    """Import a plugin and check that it keeps the contract; :class:`PluginError` otherwise."""

    def broken(cause: str) -> PluginError:
        message = f"connector type '{found.type}' of {found.source} can't be used: {cause}"
        code = "config.broken_plugin" if found.local is None else "config.broken_local"
        return PluginError(message, distribution=found.source, code=code)

    try:  # an import may fail in any way, even by sys.exit()
        if found.local is not None:
            found.local.prepare()
        loaded = found.entry_point.load()
    except (Exception, SystemExit) as error:
        explained = f"{type(error).__name__}: {error}" if found.local is None else found.local.explained(error)
        raise broken(explained) from error
    if not (isinstance(loaded, type) and issubclass(loaded, Configurer)):
        named = (
            found.entry_point.value if found.local is None else f"{found.local.class_name}, line {found.local.line},"
        )
        raise broken(f"{named} is not a Configurer class")
    version = _api_version(loaded)
    if version != API_VERSION:
        raise broken(f"it is written for API version {version}, this mosaic-core speaks {API_VERSION}")
    missing = sorted(getattr(loaded, "__abstractmethods__", ()))
    if missing:
        raise broken(f"{loaded.__name__} does not implement {', '.join(missing)}")
    return loaded


def _api_version(configurer: type) -> object:
    """``MOSAIC_API_VERSION`` of the configurer's module or of its top package; absent means ours."""
    for name in (configurer.__module__, configurer.__module__.partition(".")[0]):
        declared: object = getattr(sys.modules.get(name), "MOSAIC_API_VERSION", None)
        if declared is not None:
            return declared
    return API_VERSION
