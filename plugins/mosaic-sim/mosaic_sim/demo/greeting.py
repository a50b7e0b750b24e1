"""Writes what the demo says on the terminal."""

from __future__ import annotations

from rich.console import Console
from rich.panel import Panel
from rich.table import Table
from rich.text import Text

from mosaic_sim.demo.demo_robot import DemoRobot
from mosaic_sim.demo.errors import DemoFailed
from mosaic_sim.demo.supervisor import RunningDemo


def greet(console: Console, demo: RunningDemo, page: str, *, is_opened: bool) -> None:
    """Where to look and what to try. ``page`` holds the one-time code only if no browser was opened with it."""
    if is_opened:
        console.print("[bold green]The browser is open and signed in.[/]")
    else:
        console.print("[bold green]Ready.[/] This address signs you in, once, within a minute:")
    # On a line of its own and never wrapped, so that it can be copied and clicked.
    console.print(Text(page, style=f"bold link {page}"), soft_wrap=True)
    console.print()
    console.print(_to_try(demo.shown))
    console.print()
    for one in demo.own:
        console.print(f"From {one.source}: [bold]{one.label}[/] ({one.type})", highlight=False)
    for note in demo.notes:
        console.print(f"Note: {note}.", highlight=False, style="yellow")
    if demo.own:
        console.print(
            "What the robot logs is printed here; after a change, end the demo and start it again.\n", style="dim"
        )
    console.print(
        f"Sign in elsewhere on this machine: {demo.seed.email}, password {demo.seed.password}", highlight=False
    )
    console.print("Ctrl+C ends everything; nothing stays on this machine.", style="dim")


def _to_try(robot: DemoRobot) -> Table:
    table = Table.grid(padding=(0, 2))
    table.add_column(style="cyan", no_wrap=True)
    table.add_column()
    for number, line in enumerate(robot.to_try):
        table.add_row("" if number else "Try", line)
    return table


def report_failure(console: Console, failure: DemoFailed) -> None:
    """The culprit, its last words and the cure, on standard error."""
    console.print(Text.assemble(("error: ", "bold red"), failure.message))
    if failure.details:
        console.print(Panel(Text(failure.details), title="last log lines", border_style="red"))
    if failure.cure:
        console.print(Text.assemble(("cure: ", "bold"), failure.cure))
