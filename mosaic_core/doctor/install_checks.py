"""Checks the installation: versions in lockstep, plugins that load, and the fast event loop."""

from __future__ import annotations

import importlib.util
from collections.abc import AsyncIterator, Iterable, Iterator
from functools import partial
from importlib.metadata import Distribution, EntryPoint, distributions, entry_points

from mosaic_core import __version__
from mosaic_core.contract.checks import CHECKS_GROUP
from mosaic_core.doctor.unmet_dependencies import unmet_by_plugins
from mosaic_core.runtime.configuration.hook_calls import GROUP as HOOKS_GROUP
from mosaic_core.runtime.configuration.hook_calls import HookPlugins
from mosaic_core.runtime.configuration.resolver import ConnectorResolver
from mosaic_core.runtime.threads.code_places import explained_error
from mosaic_core.runtime.threads.daemon_call import called_on_daemon
from mosaic_core.words.errors import MosaicError
from mosaic_core.words.finding import Finding, failed, passed, skipped, warned

OUR_PREFIX = "mosaic-"


async def install_checks(resolver: ConnectorResolver) -> AsyncIterator[Finding]:
    """Imports every plugin, on a thread: a broken one may take its time to fail."""
    yield lockstep(distributions())
    yield _uvloop()
    for finding in await called_on_daemon(partial(_plugins, resolver), "doctor-install"):
        yield finding


def lockstep(installed: Iterable[Distribution]) -> Finding:
    """Our own distributions are released together, and only tested together."""
    versions = {name: one.version for one in installed if (name := _name_of(one)).startswith(OUR_PREFIX)}
    ours = {name: version for name, version in versions.items() if name in _FIRST_PARTY}
    shown = ", ".join(f"{name.removeprefix(OUR_PREFIX)} {version}" for name, version in sorted(ours.items()))
    if len({_series(version) for version in ours.values()} | {_series(__version__)}) > 1:
        return warned("install.versions", "check.version_mismatch", f"Different versions: {shown}.", facts=ours)
    return passed("install.versions", f"Installed: {shown}.", **ours)


_FIRST_PARTY = frozenset(
    f"{OUR_PREFIX}{name}"
    for name in (
        "core", "audio", "camera", "cmdvel", "i2c", "mavlink", "mqtt", "recorder", "ros2", "sensors", "server", "sim",
    )
)  # fmt: skip


def _name_of(one: Distribution) -> str:
    try:
        return str(one.metadata["Name"] or "").lower().replace("_", "-")
    except (KeyError, TypeError):
        return ""  # a distribution with broken metadata


def _series(version: str) -> str:
    """``0.1`` of ``0.1.3``: within it everything fits together."""
    return ".".join(version.split(".")[:2])


def _uvloop() -> Finding:
    if importlib.util.find_spec("uvloop") is None:
        return warned("install.uvloop", "check.no_uvloop")
    return passed("install.uvloop", "The fast event loop (uvloop) is used.")


def _plugins(resolver: ConnectorResolver) -> list[Finding]:
    found, broken = list[str](), [warned("install.local", one.code, str(one)) for one in resolver.local.problems]
    if resolver.local.refusal:
        text = f"Code beside the file is not run: {resolver.local.refusal}."
        broken.append(skipped("install.local", text))
    for one in resolver.types():
        try:
            resolver.resolve(one.type)
            found.append(one.type)
        except MosaicError as error:
            broken.append(
                failed(
                    f"install.plugin.{one.type}",
                    error.code,
                    error.message,
                    error.cure or f"Update or uninstall {one.distribution}.",
                )
            )
    for source, unmet in unmet_by_plugins(resolver):
        check = f"install.needs.{source.partition(' ')[0]}"
        broken.append(warned(check, "check.version_mismatch", f"{source} {unmet.message}.", unmet.cure))
    for group in (CHECKS_GROUP, HOOKS_GROUP):
        broken += [finding for point in entry_points(group=group) for finding in _broken_point(group, point)]
    listed = passed("install.plugins", f"Connector types that load: {', '.join(found) or 'none'}.", types=found)
    return [listed, *broken]


def _broken_point(group: str, point: EntryPoint) -> Iterator[Finding]:
    name, source = point.name, point.dist.name if point.dist else point.value
    try:
        loaded = point.load()
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # noqa: BLE001 - an import may fail in any way
        causes = [f"can't be used: {explained_error(error)}"]
    else:
        causes = (
            [f"is not all heard: {slip}" for _, slip in HookPlugins().slips_of(loaded)] if group == HOOKS_GROUP else []
        )
    for cause in causes:
        text = f"'{name}' of {source} ({group}) {cause}"
        yield failed(f"install.plugin.{name}", "config.broken_plugin", text, f"Update or uninstall {source}.")
