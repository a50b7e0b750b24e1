"""A table that rich draws: on a terminal as wide as that, in a file or a pipe a row a line."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import typer
from rich.console import Console, RenderableType
from rich.table import Table

PIPE_WIDTH = 160
"""A file or a pipe has no edge: no reason to fold anything before the reasons get long."""
_A_ROW_A_LINE = 4096
"""Columns of a list in a file or a pipe, which programs read line by line."""


def listed(columns: Iterable[str], rows: Iterable[Iterable[RenderableType]], *, whole: Iterable[str] = ()) -> Table:
    """``rows`` under bold headings; the columns ``whole`` are pasted elsewhere and never wrapped."""
    table = Table(box=None, pad_edge=False, header_style="bold")
    for name in columns:
        table.add_column(name, no_wrap=name in whole, overflow="fold")
    for row in rows:
        table.add_row(*row)
    return table


def console(pipe_width: int | None = None) -> Console:
    """Stdout for texts of others, which may look like markup. ``pipe_width``: what counts where it is no terminal."""
    out = Console(markup=False, highlight=False)
    if pipe_width is not None and not out.is_terminal:
        out.width = pipe_width
    return out


def show(
    columns: Iterable[str],
    rows: Iterable[Sequence[RenderableType]],
    lines: Iterable[Mapping[str, Any]],
    *,
    as_json: bool,
    empty: str = "",
    whole: Iterable[str] = (),
) -> None:
    """The same things for people, as a table of ``rows``, or ``as_json``, one of ``lines`` a line. ``empty``: what is
    said instead of a table without rows."""
    if as_json:
        for line in lines:
            typer.echo(json.dumps(line, ensure_ascii=False))
        return
    table = listed(columns, rows, whole=whole)
    console(pipe_width=_A_ROW_A_LINE).print(table if table.row_count or not empty else empty)


def print_fields(heading: str, rows: Iterable[Sequence[str]], *, third: str = "default") -> None:
    """A table of fields: each ``(name, type, default, unit, description)``. ``heading``: what has them."""
    whole = {heading, third, "unit"} - {"default"}
    table = listed((heading, "type", third, "unit", "description"), rows, whole=whole)
    console(pipe_width=200).print(table)  # one row per line, for grep
    typer.echo()
