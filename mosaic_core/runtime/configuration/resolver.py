"""Finds the configurer of a connector type among the installed distributions.

The entry points of the group ``mosaic.connectors`` are the registry. Listing them imports nothing; a plugin is
imported when a configuration uses it, and only then can it be broken.
"""

from __future__ import annotations

import difflib
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from importlib.metadata import EntryPoint, entry_points
from typing import Any

from mosaic_core.contract.configurer import API_VERSION, Configurer
from mosaic_core.words.errors import MosaicError, PluginError

GROUP = "mosaic.connectors"


@dataclass(frozen=True, slots=True)
class InstalledConnector:
    """One connector type and who ships it; known without importing its code."""

    type: str
    distribution: str
    version: str
    entry_point: EntryPoint

    @property
    def source(self) -> str:
        """``mosaic-camera 0.1.0``."""
        return f"{self.distribution} {self.version}".strip()


def nearest(word: str, known: Iterable[str]) -> str | None:
    """The known name that ``word`` was probably meant to be."""
    by_lower = {name.lower(): name for name in sorted(known, reverse=True)}
    match = difflib.get_close_matches(word.lower(), by_lower, n=1, cutoff=0.6)
    return by_lower[match[0]] if match else None


class ConnectorResolver:
    """Connector types by name.

    ``installed`` defaults to the entry points of this environment; tests give their own.
    """

    def __init__(self, installed: Iterable[EntryPoint] | None = None) -> None:
        found = entry_points(group=GROUP) if installed is None else installed
        self._by_type: dict[str, list[InstalledConnector]] = {}
        for entry_point in sorted(found, key=lambda one: (one.name, one.value)):
            self._by_type.setdefault(entry_point.name, []).append(_installed(entry_point))
        self._loaded: dict[str, type[Configurer[Any]]] = {}

    def types(self) -> tuple[InstalledConnector, ...]:
        """Every installed connector type, by name; a type that two distributions claim is listed twice."""
        return tuple(one for name in sorted(self._by_type) for one in self._by_type[name])

    def find(self, connector_type: str) -> InstalledConnector:
        """Who ships ``connector_type``. Raises :class:`MosaicError` with ``config.unknown_type`` and the nearest
        name, or ``config.ambiguous_type`` naming both distributions."""
        claims = self._by_type.get(connector_type, [])
        if not claims:
            raise MosaicError(
                f"no connector type '{connector_type}'", code="config.unknown_type", cure=self._cure(connector_type)
            )
        if len(claims) > 1:
            names = " and ".join(claim.source for claim in claims)
            raise MosaicError(f"connector type '{connector_type}' is claimed by {names}", code="config.ambiguous_type")
        return claims[0]

    def resolve(self, connector_type: str) -> type[Configurer[Any]]:
        """Import and return the configurer class. Raises what :meth:`find` raises, and :class:`PluginError` naming
        distribution, version and cause when the plugin can't be used."""
        if connector_type not in self._loaded:
            self._loaded[connector_type] = load_configurer(self.find(connector_type))
        return self._loaded[connector_type]

    def _cure(self, connector_type: str) -> str:
        guess = nearest(connector_type, self._by_type)
        installed = ", ".join(sorted(self._by_type)) or "none"
        meant = f"did you mean '{guess}'? " if guess else ""
        return f"{meant}Installed: {installed}"


def _installed(entry_point: EntryPoint) -> InstalledConnector:
    # A distribution with broken metadata has no name or version; it is still worth listing.
    name, version = (entry_point.dist.name, entry_point.dist.version) if entry_point.dist else (None, None)
    module = entry_point.module.partition(".")[0]
    return InstalledConnector(entry_point.name, name or module, version or "", entry_point)


def load_configurer(installed: InstalledConnector) -> type[Configurer[Any]]:
    """Import one plugin and check that it keeps the contract; :class:`PluginError` otherwise."""
    source = installed.source

    def broken(cause: str) -> PluginError:
        return PluginError(f"connector type '{installed.type}' of {source} can't be used: {cause}", distribution=source)

    try:  # an import may fail in any way, even by sys.exit()
        loaded = installed.entry_point.load()
    except (Exception, SystemExit) as error:
        raise broken(f"{type(error).__name__}: {error}") from error
    if not (isinstance(loaded, type) and issubclass(loaded, Configurer)):
        raise broken(f"{installed.entry_point.value} is not a Configurer class")
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
