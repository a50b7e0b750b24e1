"""A command of ``mosaic`` that is imported when somebody invokes it; until then a name and a line of help stand for it.

Importing what a command needs takes longer than listing all of them: a web server, an ORM, the models of a message.
"""

from __future__ import annotations

from importlib.metadata import EntryPoint
from typing import Any

import typer
from typer.core import TyperCommand


class LaterCommand(TyperCommand):
    """``entry_point`` names a typer application, a function or a command of click."""

    def __init__(self, entry_point: EntryPoint, help_line: str) -> None:
        self.entry_point = entry_point
        super().__init__(entry_point.name, help=help_line)

    def loaded(self) -> Any:
        """The command itself."""
        return _command_of(self.entry_point.load(), self.entry_point.name)

    def make_context(self, info_name: str | None, args: list[str], parent: Any = None, **extra: Any) -> Any:
        return self.loaded().make_context(info_name, args, parent=parent, **extra)


def _command_of(target: Any, name: str) -> Any:
    if hasattr(target, "make_context"):
        return target
    if not isinstance(target, typer.Typer):
        function, target = target, typer.Typer(add_completion=False)
        target.command(name)(function)
    target.rich_markup_mode = None  # boxes around its help would take longer to import than all the rest
    command = typer.main.get_command(target)
    command.name = name
    return command
