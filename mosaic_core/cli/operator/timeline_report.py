"""A connection's timeline on the terminal: each moment, when it was, and a bar for how long it took to get there."""

from __future__ import annotations

from rich.console import Console
from rich.table import Table
from rich.text import Text

from mosaic_core.machines.peers.connection_timeline import ConnectionTimeline
from mosaic_core.words.codes import reason
from mosaic_core.words.timeline import MOMENT_TITLES

BAR_CELLS = 24


def timeline_table(timeline: ConnectionTimeline) -> Table:
    """One row per moment; the last is the end, where there was one before the connection was of use."""
    end_ms = max([one.at_ms for one in timeline.marks] + [timeline.ended_ms or 0.0, 1.0])
    table = Table(box=None, pad_edge=False, show_header=False, padding=(0, 2, 0, 0))
    table.add_column(no_wrap=True)
    table.add_column(justify="right", no_wrap=True)
    table.add_column(no_wrap=True)
    table.add_column()
    before_ms = 0.0
    for mark in timeline.marks:
        bar = Text(_bar(before_ms, mark.at_ms, end_ms), style="cyan")
        table.add_row(MOMENT_TITLES[mark.moment], f"{mark.at_ms:.0f} ms", bar, Text(mark.detail, style="dim"))
        before_ms = mark.at_ms
    if timeline.ended_ms is not None and timeline.code != "peer.closed":
        bar = Text(_bar(before_ms, timeline.ended_ms, end_ms), style="red")
        known = reason(timeline.code).sentence
        table.add_row(Text("Ended", style="red"), f"{timeline.ended_ms:.0f} ms", bar, Text(f"{timeline.code}: {known}"))
    return table


def print_timeline(timeline: ConnectionTimeline) -> None:
    """To stderr: what a command prints on stdout stays as it is."""
    Console(stderr=True, highlight=False, markup=False).print(timeline_table(timeline))


def _bar(from_ms: float, to_ms: float, end_ms: float) -> str:
    start = int(from_ms / end_ms * BAR_CELLS)
    length = max(1, round((to_ms - from_ms) / end_ms * BAR_CELLS))
    return " " * min(start, BAR_CELLS - 1) + "█" * min(length, BAR_CELLS - min(start, BAR_CELLS - 1))
