"""Calls hooks so that one broken plugin disturbs nothing: an exception is logged, the others are still called."""

from __future__ import annotations

import logging
from collections.abc import Iterable
from importlib.metadata import EntryPoint, entry_points
from typing import Any

import pluggy

from mosaic_core.contract import hooks

logger = logging.getLogger(__name__)

GROUP = "mosaic.plugins"


def hook_plugins(installed: Iterable[EntryPoint] | None = None) -> pluggy.PluginManager:
    """A plugin manager with MOSAIC's hooks and every installed plugin of the group ``mosaic.plugins``.

    A plugin that can't be loaded is named in the log, with its distribution and the cause, and left out.
    """
    plugins = pluggy.PluginManager(hooks.PROJECT)
    plugins.add_hookspecs(hooks)
    for entry_point in entry_points(group=GROUP) if installed is None else installed:
        source = f"{entry_point.dist.name} {entry_point.dist.version}" if entry_point.dist else entry_point.value
        try:
            plugins.register(entry_point.load(), name=f"{source}:{entry_point.name}")
        except (Exception, SystemExit) as error:  # noqa: BLE001 - an import may fail in any way
            logger.error("hook plugin '%s' of %s can't be used: %r", entry_point.name, source, error)
    return plugins


def call_hook(plugins: pluggy.PluginManager, name: str, /, **arguments: Any) -> None:
    """Call every implementation of the hook ``name``, newest plugin first as pluggy does."""
    for implementation in reversed(getattr(plugins.hook, name).get_hookimpls()):
        wanted = {argument: arguments[argument] for argument in implementation.argnames}
        try:
            implementation.function(**wanted)
        except (Exception, SystemExit):
            logger.exception("hook %s of %s failed", name, implementation.plugin_name)
