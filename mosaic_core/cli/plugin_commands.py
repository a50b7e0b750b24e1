"""Commands of other distributions: entry points of the group ``mosaic.commands``, imported only when invoked.

Importing a web server and an ORM takes longer than most commands run, so ``mosaic --help`` lists them by name alone.
"""

from __future__ import annotations

from collections.abc import Iterable
from importlib.metadata import EntryPoint, entry_points
from typing import Any

import typer
from typer.core import TyperCommand, TyperGroup

from mosaic_core.words.errors import PluginError

GROUP = "mosaic.commands"


class PluginCommand(TyperCommand):
    """Stands for a command of another distribution until somebody invokes it."""

    def __init__(self, entry_point: EntryPoint) -> None:
        self.entry_point = entry_point
        self.source = f"{entry_point.dist.name} {entry_point.dist.version}" if entry_point.dist else entry_point.value
        distribution = self.source.partition(" ")[0]
        super().__init__(entry_point.name, help=f"From {distribution}: `mosaic {entry_point.name} --help`.")

    def loaded(self) -> Any:
        """The command itself. Raises :class:`PluginError` naming the distribution."""
        try:
            return _command_of(self.entry_point.load(), self.entry_point.name)
        except (Exception, SystemExit) as error:
            message = f"the command '{self.name}' of {self.source} can't be used: {type(error).__name__}: {error}"
            raise PluginError(message, distribution=self.source) from error

    def make_context(self, info_name: str | None, args: list[str], parent: Any = None, **extra: Any) -> Any:
        return self.loaded().make_context(info_name, args, parent=parent, **extra)


def _command_of(target: Any, name: str) -> Any:
    if hasattr(target, "make_context"):
        return target
    if not isinstance(target, typer.Typer):
        function, target = target, typer.Typer(add_completion=False)
        target.command(name)(function)
    command = typer.main.get_command(target)
    command.name = name
    return command


class GroupWithPlugins(TyperGroup):
    """The ``mosaic`` command: its own commands, then those of other distributions. Its own win a clash of names."""

    def __init__(self, **attributes: Any) -> None:
        super().__init__(**attributes)
        for entry_point in sorted(installed_commands(), key=lambda one: one.name):
            if entry_point.name not in self.commands:
                self.commands[entry_point.name] = PluginCommand(entry_point)


def installed_commands() -> Iterable[EntryPoint]:
    """Whatever is installed now."""
    return entry_points(group=GROUP)
