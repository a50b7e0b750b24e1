"""Reads a robot's file and code again when they change, and gives the running robot the connectors that are others."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractAsyncContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from mosaic_core.contract.devices.shared import Shared
from mosaic_core.runtime.configuration.auto_configurer import AutoConfigurer, Configured
from mosaic_core.runtime.configuration.checked_config import CheckedConfig, CheckedConnector
from mosaic_core.runtime.configuration.config_hints import tell_hints
from mosaic_core.runtime.configuration.config_loader import load_config
from mosaic_core.runtime.configuration.connector import Connector
from mosaic_core.runtime.configuration.local_connectors import FOLDER
from mosaic_core.runtime.configuration.resolver import ConnectorResolver
from mosaic_core.runtime.reload.own_modules import ForgottenModules, own_modules, touched_by
from mosaic_core.runtime.reload.source_watch import SourceWatch
from mosaic_core.runtime.reload.unforeseen import as_mistake, on_a_thread
from mosaic_core.words.errors import ConfigError, Problem, untold

logger = logging.getLogger(__name__)

PERIOD_S = 0.4
"""Between two looks: soon for a person, nothing for the processor."""


class RunningRobot(Protocol):
    """What is given other connectors."""

    def held(self, connectors: Sequence[Connector]) -> AbstractAsyncContextManager[None]: ...
    async def become(self, connectors: Sequence[Connector], shared: Shared) -> None: ...


@dataclass(frozen=True, slots=True)
class Reread:
    """What a robot shall be by its files now. ``running``: by label, the connectors that stay as they are; the other
    labels are of those that begin anew, come, and go."""

    checked: CheckedConfig
    resolver: ConnectorResolver
    running: Mapping[str, Connector]
    restarted: tuple[str, ...]
    added: tuple[str, ...]
    removed: tuple[str, ...]

    @property
    def is_news(self) -> bool:
        return bool(self.restarted or self.added or self.removed)

    def __str__(self) -> str:
        parts = {"begun anew": self.restarted, "new": self.added, "gone": self.removed}
        if not self.is_news:
            return "no connector is another, what ran goes on"
        return "; ".join(f"{what}: {', '.join(labels)}" for what, labels in parts.items() if labels)


class Reloader:
    """Watches the file at ``path`` and the code of its connectors. ``resolver``: finds connector types anew each time.
    ``tell``: hears every mistake; what runs goes on then."""

    def __init__(
        self,
        path: Path,
        resolver: Callable[[], ConnectorResolver],
        tell: Callable[[Sequence[Problem]], object],
        auto: AutoConfigurer | None = None,
    ) -> None:
        """Reads the file. Raises :class:`ConfigError`."""
        auto = auto or AutoConfigurer(resolver=resolver())
        self._path = path.resolve()
        self._resolver = resolver
        self._tell = tell
        self.checked = load_config(path, resolver=auto.resolver)
        self.configured = auto.configure(self.checked)
        self._begun_with = _without_connectors(self.checked)
        self._modules = _modules_of(self.checked)
        self._touched: frozenset[Path] = frozenset()
        self._useless: frozenset[Path] = frozenset()
        """Changes that were no use so far; a later one may mend them."""
        self._watch = SourceWatch(self._files)

    def _files(self) -> Iterator[Path]:
        yield self._path
        yield from (self._path.parent / FOLDER).glob("*.py")
        yield from self._modules.values()

    async def run(self, robot: RunningRobot) -> None:
        """Until it is cancelled. Event loop; what blocks is done on threads."""
        while True:
            await asyncio.sleep(PERIOD_S)
            if await asyncio.to_thread(self._has_changed):
                await self.reload(robot)

    def _has_changed(self) -> bool:
        """Whether there is something new that somebody has finished writing."""
        changed = self._watch.changed()
        self._touched |= changed
        return bool(self._touched) and not changed

    async def reload(self, robot: RunningRobot) -> None:
        """Read everything again; what is wrong is told, and changes nothing."""
        changed, self._touched = self._touched | self._useless, frozenset()
        try:
            reread = await self._renew(robot, changed)
        except ConfigError as error:
            self._useless = changed
            self._tell(error.problems)
        else:
            self._useless = frozenset()
            logger.info("reloaded %s: %s", self._path.name, reread)

    async def _renew(self, robot: RunningRobot, changed: frozenset[Path]) -> Reread:
        """Have the robot become what the files say now. Raises :class:`ConfigError` where they can't be used, and
        nothing else that code of plugins may raise; everything is as it was then."""
        forgotten = await on_a_thread(lambda: ForgottenModules(touched_by(changed, self._modules)))
        try:
            reread = await on_a_thread(self._reread)
            configured = await self._become(robot, reread)
        except BaseException:
            forgotten.restore()
            raise
        before, hinted = self.checked, self.configured.hints
        self.checked, self.configured = reread.checked, configured
        tell_hints(configured.hints, hinted)
        self._modules = await on_a_thread(lambda: _modules_of(reread.checked))
        self._watch.learn()
        if _without_connectors(reread.checked) not in (_without_connectors(before), self._begun_with):
            logger.warning("%s: beside its connectors more has changed, which counts when the robot is started anew",
                           self._path.name)  # fmt: skip
        return reread

    async def _become(self, robot: RunningRobot, reread: Reread) -> Configured:
        """Motion is made safe before an object of the new code is made, and rests until one takes the old one's place
        or can't be made."""
        if not reread.is_news:
            return self.configured
        leaving = {*reread.restarted, *reread.removed}
        async with robot.held([one for one in self.configured.connectors if one.config.label in leaving]):
            configured = await on_a_thread(lambda: self._configured(reread))
            try:
                await robot.become(configured.connectors, configured.shared)
            except (Exception, SystemExit) as error:
                begun = ", ".join((*reread.restarted, *reread.added))
                raise as_mistake(error, f"{begun} can't begin, and stands") from error
        return configured

    def _reread(self) -> Reread:
        """What the files say now; makes no handler. Any thread. Raises :class:`ConfigError`."""
        resolver = self._resolver()
        try:
            checked = load_config(self._path, resolver=resolver)
        except ConfigError as error:  # what is missing now may be what a broken file offers
            told = tuple(without_echoes(error.problems, resolver.local.problems, self.checked))
            raise ConfigError([*untold(resolver.local.problems, told), *told]) from None
        for problem in resolver.local.problems:  # of a file that nobody uses
            logger.warning("%s", problem)
        old = {one.config.label: one for one in self.checked.connectors}
        new = {one.config.label: one for one in checked.connectors}
        same = {label for label, one in new.items() if label in old and _is_same(old[label], one)}
        return Reread(
            checked,
            resolver,
            {one.config.label: one for one in self.configured.connectors if one.config.label in same},
            tuple(label for label in new if label in old and label not in same),
            tuple(label for label in new if label not in old),
            tuple(label for label in old if label not in new),
        )

    def _configured(self, reread: Reread) -> Configured:
        """Only what is not running yet is made. Any thread. Raises :class:`ConfigError`."""
        shared = self.configured.shared.without({*reread.restarted, *reread.removed})
        auto = AutoConfigurer(resolver=reread.resolver, plugins=self.configured.plugins, shared=shared)
        return auto.configure(reread.checked, running=reread.running)


def without_echoes(problems: Sequence[Problem], broken: Sequence[Problem], before: CheckedConfig) -> Iterator[Problem]:
    """Those of ``problems`` that are no mere consequence of ``broken`` files, whose own mistakes are told as well: a
    type that such a file offered ``before``."""
    files = {one.file for one in broken}
    gone = {one.config.type for one in before.connectors if (local := one.installed.local) and str(local.file) in files}
    echoes = {f"no connector type '{one}'" for one in gone}
    for one in problems:
        if not (one.code == "config.unknown_type" and one.message in echoes):
            yield one


def _modules_of(checked: CheckedConfig) -> dict[str, Path]:
    return own_modules(dict.fromkeys(one.configurer.__module__ for one in checked.connectors))


def _is_same(old: CheckedConnector, new: CheckedConnector) -> bool:
    return (
        old.configurer is new.configurer
        and old.config == new.config
        and old.params == new.params
        and old.safety == new.safety
    )


def _without_connectors(checked: CheckedConfig) -> object:
    return checked.config.model_copy(update={"connectors": ()})
