"""Commands of other distributions: entry points of the group ``mosaic.commands``, imported only when invoked."""

from __future__ import annotations

from collections.abc import Iterable
from importlib.metadata import EntryPoint, entry_points
from typing import Any

from typer.core import TyperGroup

from mosaic_core.cli.later_command import LaterCommand
from mosaic_core.words.errors import PluginError

GROUP = "mosaic.commands"


class PluginCommand(LaterCommand):
    """Stands for a command of another distribution until somebody invokes it."""

    def __init__(self, entry_point: EntryPoint) -> None:
        self.source = f"{entry_point.dist.name} {entry_point.dist.version}" if entry_point.dist else entry_point.value
        distribution = self.source.partition(" ")[0]
        super().__init__(entry_point, f"From {distribution}: `mosaic {entry_point.name} --help`.")

    def loaded(self) -> Any:
        """The command itself. Raises :class:`PluginError` naming the distribution."""
        try:
            return super().loaded()
        except (Exception, SystemExit) as error:
            message = f"the command '{self.name}' of {self.source} can't be used: {type(error).__name__}: {error}"
            raise PluginError(message, distribution=self.source) from error


class GroupWithPlugins(TyperGroup):
    """A group of commands, followed by those of other distributions. Its own win a clash of names."""

    def __init__(self, **attributes: Any) -> None:
        super().__init__(**attributes)
        for entry_point in sorted(installed_commands(), key=lambda one: one.name):
            if entry_point.name not in self.commands:
                self.commands[entry_point.name] = PluginCommand(entry_point)


def installed_commands() -> Iterable[EntryPoint]:
    """Whatever is installed now."""
    return entry_points(group=GROUP)
