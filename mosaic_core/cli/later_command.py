"""A command of ``mosaic`` that is imported when somebody invokes it; until then a name and a line of help stand for it.

Importing what a command needs takes longer than listing all of them: a web server, an ORM, the models of a message.
"""

from __future__ import annotations

from importlib.metadata import EntryPoint
from typing import Any

import typer
from typer.core import TyperCommand

from mosaic_core.words.errors import PluginError

HELP_OPTIONS = ["-h", "--help"]
"""What shows the help of every command."""


class LaterCommand(TyperCommand):
    """A command that is imported when it is asked for. ``entry_point`` names a typer application, a function or a
    command of click.
    """

    def __init__(self, entry_point: EntryPoint, help_line: str) -> None:
        self.entry_point = entry_point
        super().__init__(entry_point.name, help=help_line)

    def loaded(self) -> Any:
        """The command itself."""
        return _command_of(self.entry_point.load(), self.entry_point.name)

    def make_context(self, info_name: str | None, args: list[str], parent: Any = None, **extra: Any) -> Any:
        return self.loaded().make_context(info_name, args, parent=parent, **extra)


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


def _command_of(target: Any, name: str) -> Any:
    if hasattr(target, "make_context"):
        return target
    if not isinstance(target, typer.Typer):
        function, target = target, typer.Typer(add_completion=False)
        target.command(name)(function)
    target.rich_markup_mode = None  # boxes around its help would take longer to import than all the rest
    command = typer.main.get_command(target)
    command.name = name
    spare_pydantic(command)
    return command


def spare_pydantic(command: Any) -> None:
    """Let typer's own flags (``--help``) be off where they are not given. They would be ``None``, which typer has
    pydantic turn into ``None``, and loading that takes longer than all that a list of names needs. A flag that can be
    denied (``--no-…``) is neither on nor off where it is not given."""
    # A command keeps the help option of the first context that asks for it.
    for option in command.get_params(typer.Context(command, help_option_names=HELP_OPTIONS)):
        if getattr(option, "is_flag", False) and option.default is None and not option.secondary_opts:
            option.default = False
    for inner in getattr(command, "commands", {}).values():
        if not isinstance(inner, LaterCommand):
            spare_pydantic(inner)
