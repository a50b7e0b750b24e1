"""Makes connectors from a configuration: read, resolve, before-hook, configure each, register, after-hook.

These are MOSAIC's documented steps in their order. Unlike the original, no step skips what fails: every mistake is
collected and nothing starts.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, TypeAlias

import pluggy
from pydantic import PydanticUserError

from mosaic_core.contract.configurer import Configurer
from mosaic_core.contract.declared.code_lines import code_of, standing_at
from mosaic_core.contract.devices.shared import Shared
from mosaic_core.contract.handler import Handler, check_made
from mosaic_core.runtime.configuration.catalogue_entry import catalogue_entries
from mosaic_core.runtime.configuration.checked_config import CheckedConfig, CheckedConnector, Validation
from mosaic_core.runtime.configuration.config_loader import check_config, load_config, validate_file
from mosaic_core.runtime.configuration.connector import Connector
from mosaic_core.runtime.configuration.folder_problems import folder_problems
from mosaic_core.runtime.configuration.handler_problems import (
    WithHandlers,
    body_problems,
    delivery_problems,
    encoding_problems,
    label_problems,
    widget_problems,
)
from mosaic_core.runtime.configuration.hook_calls import call_hook, hook_plugins
from mosaic_core.runtime.configuration.lease_groups import lease_groups, lookalikes
from mosaic_core.runtime.configuration.mistakes.example_hints import example_hints
from mosaic_core.runtime.configuration.mistakes.guard_hints import guard_hints
from mosaic_core.runtime.configuration.mistakes.silent_hints import silent_hints
from mosaic_core.runtime.configuration.mistakes.unmade import broken, broken_by, no_handler, unmade
from mosaic_core.runtime.configuration.request_problems import request_problems
from mosaic_core.runtime.configuration.resolver import ConnectorResolver
from mosaic_core.runtime.configuration.safety_problems import safety_problems
from mosaic_core.runtime.threads.slow_code import told_when_slow
from mosaic_core.words.config import LABEL, RobotConfig
from mosaic_core.words.errors import ConfigError, MosaicError, Problem, by_line

MadeConfigurer: TypeAlias = tuple[CheckedConnector, Configurer[Any]]
KeptConnector: TypeAlias = tuple[CheckedConnector, Connector]
_NONE: Mapping[str, Connector] = MappingProxyType({})


@dataclass(frozen=True, slots=True)
class Configured:
    """Everything that a robot is built from."""

    config: RobotConfig
    connectors: tuple[Connector, ...]
    shared: Shared
    plugins: pluggy.PluginManager
    hints: tuple[Problem, ...] = ()
    """What the file says and is only odd, by its lines."""


@dataclass(frozen=True, slots=True)
class Rehearsal:
    """The result of a rehearsed start: what it would refuse, what is only odd, and the connectors that each lease
    covers, by resource, with their labels as the file has them."""

    problems: tuple[Problem, ...]
    hints: tuple[Problem, ...]
    leases: Mapping[str, tuple[str, ...]]


class AutoConfigurer:
    """Makes the connectors of one robot.

    ``resolver`` and ``plugins`` default to what is installed. Use an instance once per robot: connectors share its
    :attr:`shared`.
    """

    def __init__(
        self,
        *,
        resolver: ConnectorResolver | None = None,
        plugins: pluggy.PluginManager | None = None,
        shared: Shared | None = None,
    ) -> None:
        self.resolver = resolver or ConnectorResolver()
        self.plugins = plugins or hook_plugins()
        self.shared = shared or Shared()

    def from_file(self, path: Path | str, *, environ: Mapping[str, str] | None = None) -> Configured:
        """Configure from a YAML file. Raises :class:`ConfigError` with every mistake and its line."""
        return self.configure(load_config(path, resolver=self.resolver, environ=environ))

    def from_config(self, config: RobotConfig) -> Configured:
        """Configure from a configuration made in Python. Raises :class:`ConfigError`."""
        return self.configure(check_config(config, resolver=self.resolver))

    def configure(self, checked: CheckedConfig, *, running: Mapping[str, Connector] = _NONE) -> Configured:
        """The steps after reading. Raises :class:`ConfigError` naming connector and distribution. ``running``: by
        label, connectors that are made already and stay the objects that they are."""
        problems: list[Problem] = []
        kept = [(one, running[one.config.label]) for one in checked.connectors if one.config.label in running]
        made = self._configurers([one for one in checked.connectors if one.config.label not in running], problems)
        if not problems:
            configurers = [configurer for _, configurer in made]
            call_hook(self.plugins, "mosaic_before_configure", config=checked.config, configurers=configurers)
        connectors = _connectors(made, problems, kept)
        if problems:
            raise ConfigError(problems)
        place = {one.config.label: number for number, one in enumerate(checked.connectors)}
        connectors.sort(key=lambda connector: place[connector.config.label])
        every = [handler for connector in connectors for handler in connector.handlers]
        call_hook(self.plugins, "mosaic_after_configure", config=checked.config, handlers=every)
        odd = by_line((*checked.hints, *_hints(connectors, checked.connectors)))
        hints = tuple(one for one in odd if one.path)  # who starts it has an answer to a server that is not named
        return Configured(checked.config, tuple(connectors), self.shared, self.plugins, hints)

    def rehearse_file(self, path: Path | str, *, allow_missing_env: bool = False) -> tuple[Validation, Rehearsal]:
        """All that a start with this file would refuse: what is written, and what its connectors make of it. Raises
        :class:`ConfigError` where nothing can be made of the file."""
        validation = validate_file(path, resolver=self.resolver, allow_missing_env=allow_missing_env)
        return validation, self.rehearse(validation)

    def rehearse(self, validation: Validation) -> Rehearsal:
        """What :meth:`configure` would say of the connectors that have no mistake so far; calls no hook.

        Handlers are made and thrown away: what they do to devices begins with their bodies.
        """
        problems: list[Problem] = []
        made = self._configurers(validation.connectors, problems)
        connectors = _connectors(made, problems)
        hints = tuple(_hints(connectors, validation.connectors))
        written = {one.config.label: one.written_label for one in validation.connectors}
        leases = {lease: tuple(map(written.__getitem__, its)) for lease, its in lease_groups(connectors).items()}
        return Rehearsal(tuple(problems), hints, leases)

    def alone(self, one: CheckedConnector) -> Connector:
        """The connector without what its params may name beside it. Raises :class:`ConfigError`; calls no hook."""
        problems: list[Problem] = []
        made = [_made(one, configurer, problems)[1] for _, configurer in self._configurers([one], problems)]
        connectors = [connector for connector in made if connector is not None]
        problems += _taken_channels(connectors, {one.config.label: one})
        if problems:
            raise ConfigError(problems)
        return connectors[0]

    def _configurers(self, connectors: Sequence[CheckedConnector], problems: list[Problem]) -> list[MadeConfigurer]:
        made: list[MadeConfigurer] = []
        for one in connectors:
            label = one.config.label
            try:
                made.append((one, one.configurer(label, one.params, safety=one.safety, shared=self.shared.of(label))))
            except KeyboardInterrupt:
                raise
            except BaseException as error:  # noqa: BLE001 - a plugin's code may fail in any way
                problems += unmade(one, error)
        return made


def _hints(connectors: Sequence[Connector], checked: Sequence[CheckedConnector]) -> Iterator[Problem]:
    """What only handlers show."""
    yield from lookalikes(lease_groups(connectors), checked)
    by_label = {one.config.label: one for one in checked}
    for connector in connectors:
        yield from guard_hints(by_label[connector.config.label], connector.handlers)
        yield from silent_hints(by_label[connector.config.label], connector.handlers)
        yield from example_hints(by_label[connector.config.label])


def _connectors(
    made: Sequence[MadeConfigurer], problems: list[Problem], kept: Sequence[KeptConnector] = ()
) -> list[Connector]:
    connectors = [connector for _, connector in kept]
    known: list[WithHandlers] = [(one, connector.handlers) for one, connector in kept]
    for one, configurer in made:
        handlers, connector = _made(one, configurer, problems)
        known += [(one, handlers)] if handlers else []
        connectors += [connector] if connector is not None else []
    every = [one for one, _ in (*kept, *made)]
    problems += label_problems(known)
    problems += folder_problems(every)
    problems += _taken_channels(connectors, {one.config.label: one for one in every})
    return connectors


def _made(
    one: CheckedConnector, configurer: Configurer[Any], problems: list[Problem]
) -> tuple[tuple[Handler, ...], Connector | None]:
    """The handlers of a connector, and the connector itself unless its code can't say what it is."""
    handlers: tuple[Handler, ...] = ()
    try:
        handlers = _handlers(one, configurer, problems)
        if handlers:
            problems += problems_of(one, handlers)
            return handlers, _connector(one, handlers)
    except PydanticUserError as error:
        problems.append(broken(one, f"its message type has no JSON Schema: {error.message}"))
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # noqa: BLE001 - what a handler says of itself may be a property
        problems.append(broken_by(one, error))
    return handlers, None


def problems_of(one: CheckedConnector, handlers: tuple[Handler, ...]) -> Iterator[Problem]:
    """What a robot would refuse of one connector and the handlers that it made."""
    yield from body_problems(one, handlers)
    yield from safety_problems(one, handlers)
    yield from delivery_problems(one, handlers)
    yield from request_problems(one, handlers)
    yield from encoding_problems(one, handlers)
    yield from widget_problems(one, handlers)


def _handlers(one: CheckedConnector, configurer: Configurer[Any], problems: list[Problem]) -> tuple[Handler, ...]:
    try:
        with told_when_slow(f"configure() of {one.whose}"):
            made = configurer.configure()
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # noqa: BLE001 - a plugin's code may fail in any way
        problems += unmade(one, error)
        return ()
    return usable_handlers(one, made, problems)


def usable_handlers(one: CheckedConnector, made: object, problems: list[Problem]) -> tuple[Handler, ...]:
    """The handlers among what ``configure()`` returned, ``made``; none where something else is among them, or one that
    was not made as a handler must be."""

    def refused(cause: str, thing: object, cure: str = "") -> tuple[Handler, ...]:
        problems.append(broken(one, cause, cure=cure, at=code_of(thing)))
        return ()

    handlers = tuple(made) if isinstance(made, Sequence) and not isinstance(made, str) else (made,)
    if not handlers or not all(isinstance(handler, Handler) for handler in handlers):
        cause, cure = no_handler(made, handlers)
        return refused(cause, one.configurer.configure, cure)
    unnamed = next(
        (type(handler) for handler in handlers if not isinstance(getattr(handler, "label", None), str)), None
    )
    if unnamed is not None:
        how = f"call super().__init__(label) with a text in {unnamed.__name__}.__init__"
        return refused("its handler has no label", unnamed, how)
    bad = [handler.label for handler in handlers if not LABEL.match(handler.label)]
    if bad:
        cause = f"its handlers have labels that can't be used: {', '.join(map(repr, bad))}"
        return refused(
            cause, one.configurer.configure, "begin them with a letter or digit; letters, digits and _.:/- may follow"
        )
    try:
        for handler in handlers:
            check_made(handler)
    except MosaicError as wrong:
        problems.append(broken_by(one, wrong))
        return ()
    return handlers


def _connector(one: CheckedConnector, handlers: tuple[Handler, ...]) -> Connector:
    entries = catalogue_entries(one.config.label, one.config.type, handlers, one.safety, one.config.delivery)
    return Connector(one.config, handlers, entries, one.safety)


def _taken_channels(connectors: Sequence[Connector], checked: Mapping[str, CheckedConnector]) -> list[Problem]:
    """Names of tracks and channels must be unique beyond the connectors' labels: ``connection-check`` makes
    ``L-receiver`` and ``L-sender``."""
    owner: dict[str, str] = {}
    problems = []
    for connector in connectors:
        label = connector.config.label
        entries, handlers = [one.label for one in connector.entries], [one.label for one in connector.handlers]
        for name in dict.fromkeys((*entries, *handlers)):
            other = owner.setdefault(name, label)
            if other != label:
                message = f"connector '{label}' makes '{name}', which '{other}' has already"
                problems.append(checked[label].problem(message, "label", code="config.duplicate_label"))
        if len(set(handlers)) < len(handlers):
            problems.append(_twins(connector, checked[label]))
    return problems


def _twins(connector: Connector, one: CheckedConnector) -> Problem:
    """Two handlers of one connector whose label is the same."""
    labels = [handler.label for handler in connector.handlers]
    label = next(label for label in labels if labels.count(label) > 1)
    kinds = [type(handler) for handler in connector.handlers if handler.label == label]
    places = " and ".join(f"{kind.__name__}{standing_at(kind)}" for kind in dict.fromkeys(kinds))
    cure = 'give each a label of its own, such as f"{self.label}_state"'
    at = code_of(one.configurer.configure)
    return one.broken(f"{one.whose} makes two handlers of one label '{label}': {places}", cure=cure, at=at)
