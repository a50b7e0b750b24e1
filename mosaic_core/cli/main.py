"""The command ``mosaic``. Each command is imported when it is invoked, so that all of them start fast."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from importlib.metadata import EntryPoint, distributions
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from mosaic_core import __version__
from mosaic_core.cli.later_command import HELP_OPTIONS, LaterCommand, PluginCommand, spare_pydantic
from mosaic_core.cli.terminal.error_report import FAILED, exit_code_of, report
from mosaic_core.cli.terminal.threads_left import ended_without_threads
from mosaic_core.words.errors import MosaicError

COMMANDS = (
    ("run", "robot.run_options:app", "Run a robot: connect its connectors to operators until Ctrl+C."),
    ("service", "robot.service_commands:app", "A robot that starts with its machine."),
    ("validate", "configuration.validate_command:validate", "Check a robot's YAML file: every mistake at once."),
    ("connectors", "configuration.connectors_commands:app", "The connector types that are installed."),
    ("config", "configuration.config_commands:app", "The robot's YAML file."),
    ("plugin", "plugin.plugin_commands:app", "Plugins of your own."),
    ("operator", "operator.operator_commands:app", "Look at robots, and command them, from the terminal."),
    ("safety", "diagnosis.safety_commands:app", "Exercise what keeps a robot safe."),
    ("doctor", "diagnosis.doctor_commands:app", "What works, what does not, and what to do."),
    ("bench", "diagnosis.bench_command:bench", "Measure a robot and an operator over bad networks."),
)
"""Name, place in this package, and the first words of the command's own help, which is not imported to be listed."""
PLUGIN_GROUP = "mosaic.commands"
ELSEWHERE = {"arm": "mosaic-arm", "demo": "mosaic-sim[demo]", "joystick": "mosaic-joystick", "server": "mosaic-server"}
"""Commands that the documentation names, and what to install for them."""


class MosaicGroup(TyperGroup):
    """The ``mosaic`` command: its own commands, then those of other distributions (group ``mosaic.commands``), which
    are looked for where a name is not ours, or all are listed. Our own win a clash of names."""

    def __init__(self, **attributes: Any) -> None:
        own = {name: LaterCommand(EntryPoint(name, f"{__package__}.{at}", ""), line) for name, at, line in COMMANDS}
        super().__init__(**{**attributes, "commands": own})

    def make_context(self, *arguments: Any, **named: Any) -> Any:
        spare_pydantic(self)
        return super().make_context(*arguments, **named)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        if cmd_name not in self.commands:
            self._find_others()
        if cmd_name in ELSEWHERE and cmd_name not in self.commands:
            ctx.fail(f'`mosaic {cmd_name}` is in a distribution of its own: pip install "{ELSEWHERE[cmd_name]}"')
        return super().get_command(ctx, cmd_name)

    def list_commands(self, ctx: Any) -> list[str]:
        self._find_others()
        return super().list_commands(ctx)

    def _find_others(self) -> None:
        # Only who names the group is read: parsing the entry points of all would take twice as long.
        naming = [one for one in distributions() if f"[{PLUGIN_GROUP}]" in (one.read_text("entry_points.txt") or "")]
        found = (point for one in naming for point in one.entry_points if point.group == PLUGIN_GROUP)
        for entry_point in sorted(found, key=lambda one: one.name):
            if entry_point.name not in self.commands:
                self.commands[entry_point.name] = PluginCommand(entry_point)


app = typer.Typer(
    cls=MosaicGroup,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": HELP_OPTIONS, "max_content_width": 120},
    help="MOSAIC: robots and operators, connected peer to peer.",
)


def _show_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"mosaic-core {__version__}")
        raise typer.Exit


@app.callback()
def mosaic(
    version: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    """MOSAIC: robots and operators, connected peer to peer."""


def main(arguments: Sequence[str] | None = None) -> None:
    """The console script: runs a command and exits. With ``arguments`` another program runs it, whose threads are its
    own."""
    if arguments is not None:
        return _run(list(arguments))
    with ended_without_threads():
        return _run(sys.argv[1:])


def _run(words: list[str]) -> None:
    try:
        app(args=words, prog_name="mosaic", obj=words)
    except MosaicError as error:
        report(error)
        sys.exit(exit_code_of(error))
    except BrokenPipeError:
        # Whoever read our output (`| head`) has enough; Python would complain again while it closes stdout.
        sys.stderr.close()
        sys.exit(FAILED)


if __name__ == "__main__":
    main()
