"""What the demo says on the terminal."""

from __future__ import annotations

from rich.console import Console, Group
from rich.panel import Panel
from rich.table import Table
from rich.text import Text

from mosaic_sim.demo.errors import DemoFailed
from mosaic_sim.demo.supervisor import RunningDemo


def greet(console: Console, demo: RunningDemo, page: str, *, is_opened: bool) -> None:
    """Where to look and what to try. ``page`` holds the one-time code only if no browser was opened with it."""
    where = Table.grid(padding=(0, 2))
    where.add_column(style="bold")
    where.add_column(overflow="fold")
    where.add_row("Dashboard", Text(page, style=f"link {page}"))
    where.add_row("Sign in", f"{demo.seed.email}   password: {demo.seed.password}")
    opened = "The browser is open and signed in."
    unopened = "Open the dashboard's address: it signs you in, once, within a minute."
    body = Group(opened if is_opened else unopened, "", where, "", _to_try())
    console.print(Panel(body, title="MOSAIC demo", border_style="green", padding=(1, 2)))
    console.print("Ctrl+C ends everything; nothing stays on this machine.", style="dim")


def _to_try() -> Table:
    table = Table.grid(padding=(0, 2))
    table.add_column(style="cyan", no_wrap=True)
    table.add_column()
    table.add_row("Try", "Hold W, A, S, D or the arrow keys, or drag the drive pad: the robot drives.")
    table.add_row("", "Let go: it stops. Close the tab while driving: it stops, too.")
    table.add_row("", "Open the address in a second window: both see the same robot.")
    table.add_row("", "Park on the green pad in the south-west corner: the battery charges.")
    return table


def report_failure(console: Console, failure: DemoFailed) -> None:
    """The culprit, its last words and the cure, on standard error."""
    console.print(Text.assemble(("error: ", "bold red"), failure.message))
    if failure.details:
        console.print(Panel(Text(failure.details), title="last log lines", border_style="red"))
    if failure.cure:
        console.print(Text.assemble(("cure: ", "bold"), failure.cure))
