"""Reads and checks the robot's configuration: every mistake at once, each with its line, before anything starts.

A connector's ``params`` and ``safety`` are checked by its plugin's own models, so using a configuration means
importing the plugins that it names. No handler is made and no device opened here.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from mosaic_core.runtime.configuration.checked_config import CheckedConfig, CheckedConnector, Validation
from mosaic_core.runtime.configuration.config_hints import hints_of
from mosaic_core.runtime.configuration.config_problems import known_keys, sound_part, validated
from mosaic_core.runtime.configuration.resolver import ConnectorResolver
from mosaic_core.runtime.configuration.yaml_document import Place, YamlDocument, read_yaml
from mosaic_core.runtime.threads.code_places import explained_error, raised_at
from mosaic_core.words.config import AuthParams, ConnectorConfig, RobotConfig
from mosaic_core.words.errors import ConfigError, MosaicError, Problem, by_line


def load_config(
    path: Path | str, *, resolver: ConnectorResolver | None = None, environ: Mapping[str, str] | None = None
) -> CheckedConfig:
    """Read and check a file. Raises :class:`ConfigError` with every mistake."""
    return validate_file(path, resolver=resolver, environ=environ).sound()


def validate_file(
    path: Path | str,
    *,
    resolver: ConnectorResolver | None = None,
    environ: Mapping[str, str] | None = None,
    allow_missing_env: bool = False,
) -> Validation:
    """Check a file without using it. ``allow_missing_env`` forgives variables and secret files that only exist on the
    robot. Raises :class:`ConfigError` only where nothing at all can be read."""
    document = read_yaml(Path(path), os.environ if environ is None else environ)
    if allow_missing_env:
        document.problems = [one for one in document.problems if one.code != "config.missing_env"]
    return validate_document(document, resolver)


def load_connectors(path: Path | str, *, resolver: ConnectorResolver | None = None) -> CheckedConfig:
    """Read and check a file for what needs no server: what it says of one, and secrets that only the robot has, are no
    matter. Raises :class:`ConfigError` with every other mistake."""
    document = read_yaml(Path(path), os.environ)
    if document.tree.get("connectors"):
        document.tree.pop("server", None)
        document.unknown = {place for place in document.unknown if place[:1] != ("server",)}
        document.problems = [one for one in document.problems if one.path.partition(".")[0] != "server"]
    return validate_document(document, resolver).sound()


def check_config(config: RobotConfig, *, resolver: ConnectorResolver | None = None) -> CheckedConfig:
    """The same for a configuration made in Python. Raises :class:`ConfigError`; problems have paths but no lines."""
    tree = {"connectors": [connector.model_dump(mode="python") for connector in config.connectors]}
    document = YamlDocument(tree)
    checker = _Checker(document, resolver or ConnectorResolver())
    connectors = checker.connectors(config)
    if checker.problems:
        raise ConfigError(checker.problems)
    return CheckedConfig(config, tuple(connectors), hints_of(config, connectors, document))


def validate_document(document: YamlDocument, resolver: ConnectorResolver | None = None) -> Validation:
    """Check what :func:`read_yaml` read."""
    checker = _Checker(document, resolver or ConnectorResolver())
    config = checker.structure()
    connectors = checker.connectors(config)
    problems = by_line((*document.problems, *checker.problems))
    checked, hints = None, tuple[Problem, ...]()
    if config is not None:
        hints = hints_of(config, connectors, document)
    if config is not None and not problems and not document.unknown:
        checked = CheckedConfig(config, tuple(connectors), hints)
    known = tuple(one for one in connectors if not _is_unknown(one.place, document))
    return Validation(problems, hints, checked, document, known)


def _is_unknown(place: Place, document: YamlDocument) -> bool:
    """Whether a value at or below ``place`` depends on a missing variable or file."""
    return any(one[: len(place)] == place for one in document.unknown)


class _Checker:
    """Checks a document in one pass; collects :attr:`problems`."""

    def __init__(self, document: YamlDocument, resolver: ConnectorResolver) -> None:
        self._document = document
        self._resolver = resolver
        self._failed_imports: list[BaseException] = []
        self.problems: list[Problem] = []

    def structure(self) -> RobotConfig | None:
        config, problems = validated(RobotConfig, self._document.tree, self._document, (), self._where_it_belongs)
        self.problems += problems
        return config

    def connectors(self, config: RobotConfig | None) -> list[CheckedConnector]:
        """Check each connector that can be checked, also beside mistakes elsewhere in the file."""
        self._unique_labels()
        checked = []
        for index, raw in enumerate(self._raw_connectors()):
            one = self._connector(("connectors", index), raw, config.connectors[index] if config else None)
            if one is not None:
                checked.append(one)
        return checked

    def _raw_connectors(self) -> list[Any]:
        connectors = self._document.tree.get("connectors")
        return connectors if isinstance(connectors, list) else []

    def _unique_labels(self) -> None:
        first: dict[str, int] = {}
        for index, raw in enumerate(self._raw_connectors()):
            label = raw.get("label") if isinstance(raw, dict) else None
            place = ("connectors", index, "label")
            if label is None or place in self._document.unknown:
                continue
            earlier = first.setdefault(str(label), index)
            if earlier != index:
                line = self._document.lines.get(("connectors", earlier, "label"))
                where = f"connectors[{earlier}]" + (f", line {line}" if line else "")
                message, code = f"the label '{label}' is taken by {where}", "config.duplicate_label"
                self.problems.append(self._document.problem(place, message, code=code, cure="choose another"))

    def _connector(self, place: Place, raw: Any, config: ConnectorConfig | None) -> CheckedConnector | None:
        kind = raw.get("type") if isinstance(raw, dict) else None
        if not isinstance(kind, str) or (*place, "type") in self._document.unknown:
            return None
        try:
            installed = self._resolver.find(kind)
            configurer = self._resolver.resolve(kind)
        except MosaicError as error:
            if self._is_told(error.__cause__):
                return None
            where = place if error.at.file else (*place, "type")
            problem = self._document.problem(where, error.message, code=error.code, guess=error.cure, at=error.at)
            self.problems.append(problem)
            return None
        try:
            params = self._part(configurer.params_model, raw, (*place, "params"))
            safety = self._part(configurer.safety_model, raw, (*place, "safety"))
            if safety is None and isinstance(raw.get("safety"), dict):  # what else is wrong with it is told as well
                safety = sound_part(configurer.safety_model, raw["safety"], self._document, (*place, "safety"))
        except (Exception, SystemExit) as error:  # noqa: BLE001 - a plugin's validators may fail in any way
            message = f"connector type '{kind}' of {installed.source} can't check this: {explained_error(error)}"
            self.problems.append(self._broken(place, message, error))
            return None
        if config is None:
            # The robot's own part has a mistake or depends on what only the robot knows; this connector may be fine.
            config, _already_reported = validated(ConnectorConfig, raw, self._document, place)
        if config is None or params is None or safety is None:
            return None
        return CheckedConnector(config, configurer, params, safety, installed, place, self._document)

    def _is_told(self, cause: BaseException | None) -> bool:
        """Whether another type of the same file was told to fail for it: one mistake is one problem."""
        if cause is None or any(cause is one for one in self._failed_imports):
            return cause is not None
        self._failed_imports.append(cause)
        return False

    def _part(self, model: type[Any], raw: dict[str, Any], place: Place) -> Any:
        key = str(place[-1])
        data = raw.get(key)
        if data is not None and not isinstance(data, dict):
            return None  # the structure's mistake, and already reported as such
        try:
            value, problems = validated(model, data or {}, self._document, place)
        except Exception as error:  # noqa: BLE001 - a plugin's validator may fail in any way
            message = f"'{key}' of '{raw['type']}' can't be checked: {explained_error(error)}"
            value, problems = None, [self._broken(place, message, error)]
        self.problems += problems
        return value

    def _broken(self, place: Place, message: str, error: BaseException) -> Problem:
        return self._document.problem(place, message, code="config.broken_plugin", at=raised_at(error))

    def _where_it_belongs(self, place: Place) -> str:
        """Old files put a connector's params beside its label, and the token beside the robot's id."""
        key = str(place[-1])
        if place[:-1] in (("server", "auth"), ("server", "auth_config")) and key in AuthParams.model_fields:
            return f"write it as server.auth.params.{key}"
        if len(place) == 3 and place[0] == "connectors" and key not in ConnectorConfig.model_fields:
            with contextlib.suppress(MosaicError):
                kind = self._raw_connectors()[int(place[1])].get("type")
                if key in known_keys(self._resolver.resolve(str(kind)).params_model, ()):
                    return f"write it as params.{key}"
        return ""
