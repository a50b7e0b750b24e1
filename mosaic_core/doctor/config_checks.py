"""The robot's YAML file, and the devices that it names."""

from __future__ import annotations

import os
from collections.abc import AsyncIterator, Collection, Iterator
from dataclasses import dataclass
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from mosaic_core.contract.checks import CHECKS_GROUP, CheckContext, NamedConnector
from mosaic_core.runtime.configuration.auto_configurer import AutoConfigurer
from mosaic_core.runtime.configuration.checked_config import CheckedConnector
from mosaic_core.runtime.configuration.resolver import ConnectorResolver
from mosaic_core.runtime.configuration.yaml_document import YamlDocument
from mosaic_core.words.config import ServerConfig
from mosaic_core.words.errors import ConfigError, Problem
from mosaic_core.words.finding import Finding, failed, passed, warned

MAX_PROBLEMS = 10


@dataclass(frozen=True, slots=True)
class ConfigRead:
    """The parts of a configuration that could be read: ``server`` and ``connectors`` also of a file with mistakes, as
    far as they have none."""

    path: Path
    problems: tuple[Problem, ...]
    server: ServerConfig | None
    connectors: tuple[CheckedConnector, ...] = ()

    def context(self, timeout_s: float) -> CheckContext:
        """For the checks of other distributions."""
        named = tuple(NamedConnector(one.config.type, one.config.label, one.params) for one in self.connectors)
        return CheckContext(named, self.path, timeout_s)


def read_config(path: Path, resolver: ConnectorResolver | None = None) -> ConfigRead:
    """Read and check the file; a mistake is no error here, but a finding later."""
    try:
        validation, rehearsal = AutoConfigurer(resolver=resolver).rehearse_file(path)
    except ConfigError as error:
        return ConfigRead(path, error.problems, None)
    problems = (*validation.problems, *rehearsal.problems)
    return ConfigRead(path, problems, _server_of(validation.document), validation.connectors)


def _server_of(document: YamlDocument) -> ServerConfig | None:
    """Looked at by itself: a mistake in a connector says nothing about the way to the server."""
    if any(place[:1] == ("server",) for place in document.unknown) or not isinstance(document.tree, dict):
        return None
    try:
        return ServerConfig.model_validate(document.tree.get("server"))
    except ValidationError:
        return None


async def config_checks(read: ConfigRead) -> AsyncIterator[Finding]:
    """Each mistake with its line."""
    for problem in read.problems[:MAX_PROBLEMS]:
        place = ":".join(str(part) for part in (problem.file or read.path, problem.line) if part)
        at = f"{problem.path}: " if problem.path else ""
        facts = {"file": problem.file, "line": problem.line, "path": problem.path}
        yield failed("config.yaml", problem.code, f"{place}: {at}{problem.message}", problem.cure, facts)
    if not read.problems:
        yield passed("config.yaml", f"{read.path} is valid: {len(read.connectors)} connectors.")


async def device_checks(read: ConfigRead) -> AsyncIterator[Finding]:
    """Every path under ``/dev`` that the params of a connector name, but for those that a plugin checks itself."""
    own = {point.dist.name for point in entry_points(group=CHECKS_GROUP) if point.dist}
    for one in read.connectors:
        if one.installed.distribution in own:
            continue
        for path in dict.fromkeys(_device_paths(one.params.model_dump())):
            yield device_finding(one.config.label, Path(path))


def _device_paths(value: Any) -> Iterator[str]:
    if isinstance(value, dict):
        for inner in value.values():
            yield from _device_paths(inner)
    elif isinstance(value, list | tuple):
        for inner in value:
            yield from _device_paths(inner)
    elif isinstance(value, str | Path) and str(value).startswith("/dev/"):
        yield str(value)


def device_finding(label: str, path: Path) -> Finding:
    """Whether a device is there, and may be used by this account."""
    check, facts = f"device.{label}", {"path": str(path)}
    if not path.exists():
        others = _like(path)
        cure = f"Plug it in, or name another one: {', '.join(others)}." if others else "Plug it in."
        return failed(check, "plugin.no_device", f"{label}: there is no {path}.", cure, facts)
    if not os.access(path, os.R_OK | os.W_OK):
        return failed(check, "plugin.no_permission", f"{label}: this account may not use {path}.", facts=facts)
    if os.path.realpath(path) == str(path) and path.name.startswith(("ttyUSB", "ttyACM")):
        text = f"{label}: {path} is there; its number changes with the order of plugging."
        cure = "Name it by /dev/serial/by-id/…, which stays."
        return warned(check, "plugin.no_device", text, cure, facts)
    return passed(check, f"{label}: {path} is there and may be used.", **facts)


def _like(path: Path) -> Collection[str]:
    """Devices of the same kind: ``/dev/ttyUSB1`` for ``/dev/ttyUSB0``."""
    stem = path.name.rstrip("0123456789")
    return sorted(str(one) for one in path.parent.glob(f"{stem}*"))[:5] if path.parent.is_dir() and stem else []
