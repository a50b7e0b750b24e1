"""Says what a distribution depends on and does not find: pip tells it once, or not at all (``--no-deps``), and then a
plugin fails at some line of its own."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from importlib.metadata import Distribution, PackageNotFoundError, version

from packaging.requirements import InvalidRequirement, Requirement

from mosaic_core.runtime.configuration.resolver import ConnectorResolver


@dataclass(frozen=True, slots=True)
class UnmetDependency:
    """One of them. ``message``: continues a sentence that begins with who depends on it."""

    message: str
    cure: str


def unmet_dependencies(requires: Iterable[str]) -> Iterator[UnmetDependency]:
    """Which of these requirements, as core metadata has them, this environment does not meet. Those of extras are
    nobody's."""
    for line in requires:
        try:
            wanted = Requirement(line)
        except InvalidRequirement:
            cure = 'write its name and versions, such as "numpy>=1.26"'
            yield UnmetDependency(f"wants {line!r}, which is no requirement", cure)
            continue
        if wanted.marker is not None and not wanted.marker.evaluate({"extra": ""}):
            continue
        said, cure = f"{wanted.name}{wanted.specifier}", f'pip install "{wanted.name}{wanted.specifier}"'
        try:
            found = version(wanted.name)
        except PackageNotFoundError:
            yield UnmetDependency(f"wants {said}, which is not installed", cure)
            continue
        if not wanted.specifier.contains(found, prereleases=True):
            yield UnmetDependency(f"wants {said}, and {found} is installed", cure)


def unmet_by_plugins(resolver: ConnectorResolver) -> Iterator[tuple[str, UnmetDependency]]:
    """The same of each installed distribution with connectors, which is named with its version."""
    found: dict[str, Distribution] = {one.source: dist for one in resolver.types() if (dist := one.entry_point.dist)}
    for source, distribution in sorted(found.items()):
        yield from ((source, unmet) for unmet in unmet_dependencies(distribution.requires or ()))
