"""A table of plain text, for lists that should be there at once: rich takes longer to import than to look at a list."""

from __future__ import annotations

import shutil
import sys
import textwrap
from collections.abc import Sequence

import typer

_GAP = "  "
_LEAST_WIDTH = 20


def print_table(headings: Sequence[str], rows: Sequence[Sequence[str]], *, folded: int) -> None:
    """Write ``rows`` to stdout. On a terminal the column ``folded`` takes several lines where it must; in a file or a
    pipe every row is one line, for grep."""
    widths = [max(map(len, column)) for column in zip(headings, *rows, strict=True)]
    if sys.stdout.isatty():
        left = shutil.get_terminal_size().columns - sum(widths) - len(_GAP) * (len(widths) - 1) + widths[folded]
        widths[folded] = max(min(widths[folded], left), _LEAST_WIDTH)
    typer.secho(_line(headings, widths), bold=True)
    for row in rows:
        texts = textwrap.wrap(row[folded], widths[folded]) or [""]
        typer.echo(_line([*row[:folded], texts[0], *row[folded + 1 :]], widths))
        for text in texts[1:]:
            typer.echo(_line([text if column == folded else "" for column in range(len(row))], widths))


def _line(cells: Sequence[str], widths: Sequence[int]) -> str:
    return _GAP.join(cell.ljust(width) for cell, width in zip(cells, widths, strict=True)).rstrip()
