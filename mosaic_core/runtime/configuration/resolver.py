"""Finds the configurer of a connector type among the installed distributions and the files beside a configuration.

The entry points of the group ``mosaic.connectors`` are the registry. Listing them imports nothing; a plugin is
imported when a configuration uses it, and only then can it be broken.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cache
from importlib.metadata import Distribution, EntryPoint, distributions, entry_points
from typing import TYPE_CHECKING, Any, TypeAlias

from mosaic_core.runtime.configuration.local_connectors import LocalConnector, LocalConnectors
from mosaic_core.words.errors import MosaicError, nearest, slip_of

if TYPE_CHECKING:
    from mosaic_core.contract.configurer import Configurer

GROUP = "mosaic.connectors"
MANY_TYPES = 20
"""More are no help in an error."""
MANY_PROBLEMS = 3
"""As many mistakes of files are one readable line."""


@dataclass(frozen=True, slots=True)
class InstalledConnector:
    """One connector type and who ships it; known without importing its code."""

    type: str
    distribution: str
    version: str
    entry_point: EntryPoint
    local: LocalConnector | None = None
    """Where it stands, if nobody ships it: ``distribution`` names the file then."""

    @property
    def source(self) -> str:
        """``mosaic-camera 0.1.0``, ``connectors/….py``."""
        return f"{self.distribution} {self.version}".strip()

    @property
    def place(self) -> str:
        """The source, with the line of a file."""
        return self.source if self.local is None else f"{self.source}:{self.local.line}"


def uninstalled(configurer: type, connector_type: str) -> InstalledConnector:
    """The connector type of a class that nobody ships, as if its module did."""
    origin = f"{configurer.__module__}:{configurer.__qualname__}"
    return InstalledConnector(connector_type, origin, "", EntryPoint(connector_type, origin, GROUP))


class ConnectorResolver:
    """Connector types by name.

    ``installed`` defaults to the entry points of this environment; tests give their own. ``local`` are those that
    stand beside a configuration.
    """

    def __init__(self, installed: Iterable[EntryPoint] | None = None, *, local: LocalConnectors | None = None) -> None:
        self.local = local or LocalConnectors()
        found = entry_points(group=GROUP) if installed is None else installed
        self._by_type: dict[str, list[InstalledConnector]] = {}
        identity = cache(_identity)  # which parses a file that may be long
        for entry_point in sorted(found, key=lambda one: (one.name, one.value)):
            self._by_type.setdefault(entry_point.name, []).append(_installed(entry_point, identity))
        for one in () if self.local.refusal else self.local.connectors:
            beside = InstalledConnector(one.type, one.source, "", one.entry_point, one)
            self._by_type.setdefault(one.type, []).append(beside)
        self._loaded: dict[str, type[Configurer[Any]]] = {}
        self._failed_imports: dict[str, BaseException] = {}

    def types(self) -> tuple[InstalledConnector, ...]:
        """Every connector type that may be used, by name; one that two claim is listed twice."""
        return tuple(one for name in sorted(self._by_type) for one in self._by_type[name])

    def find(self, connector_type: str) -> InstalledConnector:
        """Who ships ``connector_type``. Raises :class:`MosaicError` with ``config.unknown_type`` and the nearest
        name, ``config.local_off`` where it is in a file that must not be run, or ``config.ambiguous_type`` naming
        both places."""
        claims = self._by_type.get(connector_type, [])
        if not claims:
            raise self._unknown(connector_type)
        if len(claims) > 1:
            names = " and ".join(claim.place for claim in claims)
            renamed = next((f"Choose another connector_type in {one.place}." for one in claims if one.local), None)
            message = f"connector type '{connector_type}' is claimed by {names}"
            raise MosaicError(message, code="config.ambiguous_type", cure=renamed)
        return claims[0]

    def resolve(self, connector_type: str) -> type[Configurer[Any]]:
        """Import and return the configurer class. Raises what :meth:`find` raises, and :class:`PluginError` naming
        distribution, version and cause when the plugin can't be used. A module whose import fails is imported once,
        for all its types."""
        # Only now: `mosaic connectors list` needs no contract to check plugins against, and none of its models.
        from mosaic_core.runtime.configuration.plugin_loading import load_configurer

        if connector_type not in self._loaded:
            found = self.find(connector_type)
            its = found.entry_point, found.source, found.local
            self._loaded[connector_type] = load_configurer(*its, self._failed_imports)
        return self._loaded[connector_type]

    def _unknown(self, connector_type: str) -> MosaicError:
        for one in self.local.connectors:
            if one.type == connector_type:
                message = f"the code of {one.source}, which has the type '{one.type}', is not run: {self.local.refusal}"
                return MosaicError(message, code="config.local_off")
        cure = self._cure(connector_type)
        return MosaicError(f"no connector type '{connector_type}'", code="config.unknown_type", cure=cure)

    def _cure(self, connector_type: str) -> str:
        guess = nearest(connector_type, self._by_type)
        meant = f"did you mean '{guess}'? " if guess else ""
        readable = {str(one.unreadable.file) for one in self.local.connectors if one.unreadable is not None}
        doubtful = [one for one in self.local.problems if one.file not in readable]  # nobody knows their types
        if doubtful:
            told = "; ".join(str(one) for one in doubtful[:MANY_PROBLEMS])
            return f"{meant}If '{connector_type}' is of a file beside the configuration, mend it: {told}"
        unnamed = _installed_without(connector_type)
        if unnamed:
            return f"{meant}{unnamed}"
        if len(self._by_type) > MANY_TYPES:
            every = f"`mosaic connectors list` shows all {len(self._by_type)}"
            return f"{meant}{every}; one of your own is among them {self._where_own_ones_belong()}"
        return f"{meant}Installed: {', '.join(sorted(self._by_type)) or 'none'}"

    def _where_own_ones_belong(self) -> str:
        if self.local.connectors:
            return "once it stands in the folder connectors/, as connector_type of a class"
        return "once it stands in the folder connectors/ beside the YAML file, or is installed: pip install -e FOLDER"


def _installed_without(connector_type: str) -> str:
    """The cure where a distribution seems to have the type and does not say so as it must; empty otherwise."""
    write = f'[project.entry-points."{GROUP}"] in its pyproject.toml, and install it again'
    for one in distributions():
        wrong = {point.group for point in one.entry_points if point.name == connector_type and point.group != GROUP}
        group = slip_of(GROUP, wrong)
        if group is not None:
            name, version = _identity(one)
            return f"{name} {version} names it in the group '{group}', which nobody reads: write {write}"
    for one in distributions(name=connector_type):
        name, version = _identity(one)
        names_none = all(point.group != GROUP for point in one.entry_points)
        if names_none and (name or "").lower().replace("_", "-") == connector_type:
            return f"{name} {version} is installed and names no connector: write {write}"
    return ""


Identity: TypeAlias = tuple[str | None, str | None]
"""A distribution's name and version. One with broken metadata has neither; what it installs is still worth listing."""


def _installed(entry_point: EntryPoint, identity: Callable[[Distribution], Identity]) -> InstalledConnector:
    name, version = identity(entry_point.dist) if entry_point.dist else (None, None)
    module = re.split("[.:]", entry_point.value)[0].strip()  # its own parts are not there where its words are none
    return InstalledConnector(entry_point.name, name or module, version or "", entry_point)


def _identity(distribution: Distribution) -> Identity:
    metadata = distribution.metadata
    return metadata["Name"], metadata["Version"]
