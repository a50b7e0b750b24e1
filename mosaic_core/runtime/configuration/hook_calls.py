"""Calls hooks so that one broken plugin disturbs nothing: an exception is logged, the others are still called."""

from __future__ import annotations

import logging
from collections.abc import Iterable
from importlib.metadata import EntryPoint, entry_points
from typing import Any

import pluggy

from mosaic_core.contract import hooks
from mosaic_core.runtime.configuration.mistakes.hook_slips import hook_slips
from mosaic_core.runtime.threads.code_places import explained_error

__all__ = ["HookPlugins", "call_hook", "hook_plugins"]

logger = logging.getLogger(__name__)

GROUP = "mosaic.plugins"


class HookPlugins(pluggy.PluginManager):
    """The hook plugins of one robot. A function of theirs that could not be called is told in the log when its plugin
    is registered, with its line, and left out."""

    def __init__(self) -> None:
        super().__init__(hooks.PROJECT)
        self.add_hookspecs(hooks)

    def register(self, plugin: Any, name: str | None = None) -> str | None:
        """Hear a plugin: an object or a module with hooks. Raises ``ValueError`` for one that is there already."""
        for _, slip in self.slips_of(plugin):
            logger.error("hook plugin %s: %s", name or self.get_canonical_name(plugin), slip)
        return super().register(plugin, name)

    def slips_of(self, plugin: Any) -> list[tuple[str, str]]:
        """Name and mistake of each function of a plugin that was meant as a hook and could not be called."""
        found = ((name, super(HookPlugins, self).parse_hookimpl_opts(plugin, name)) for name in dir(plugin))
        return list(hook_slips(plugin, {name: dict(mark) for name, mark in found if mark is not None}))

    def parse_hookimpl_opts(self, plugin: Any, name: str) -> Any:
        """As pluggy asks what ``@hookimpl`` says above a function; ``None`` where it is none that could be called."""
        mark = super().parse_hookimpl_opts(plugin, name)
        return None if mark is None or dict(hook_slips(plugin, {name: dict(mark)})).get(name) else mark


def hook_plugins(installed: Iterable[EntryPoint] | None = None) -> HookPlugins:
    """A plugin manager with MOSAIC's hooks and every installed plugin of the group ``mosaic.plugins``.

    A plugin that can't be loaded is named in the log, with its distribution, the cause and its line, and left out.
    """
    plugins = HookPlugins()
    for entry_point in entry_points(group=GROUP) if installed is None else installed:
        source = f"{entry_point.dist.name} {entry_point.dist.version}" if entry_point.dist else entry_point.value
        try:
            plugins.register(entry_point.load(), name=f"{source}:{entry_point.name}")
        except KeyboardInterrupt:
            raise
        except BaseException as error:  # noqa: BLE001 - an import may fail in any way
            logger.error("hook plugin '%s' of %s can't be used: %s", entry_point.name, source, explained_error(error))
    return plugins


def call_hook(plugins: pluggy.PluginManager, name: str, /, **arguments: Any) -> None:
    """Call every implementation of the hook ``name``, newest plugin first as pluggy does."""
    for implementation in reversed(getattr(plugins.hook, name).get_hookimpls()):
        taken = (*implementation.argnames, *implementation.kwargnames)
        wanted = {argument: arguments[argument] for argument in taken if argument in arguments}
        try:
            implementation.function(**wanted)
        except KeyboardInterrupt:
            raise
        except BaseException:  # whatever a plugin raises ends no robot
            logger.exception("hook %s of %s failed", name, implementation.plugin_name)
