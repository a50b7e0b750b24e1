"""The rows as people read them, and as documents keep them."""

from __future__ import annotations

from collections.abc import Sequence

from rich.table import Table

from mosaic_core.bench.figures import Figures

COLUMNS = (
    "profile", "command p50 / p95 ms", "not obeyed", "picture age p50 / p95 ms", "pictures/s", "freezes/min", "Mbit/s",
    "recovery s", "connect s", "first picture s",
)  # fmt: skip
NOT_SEEN = "–"


def cells(row: Figures) -> list[str]:
    """One row, in the order of :data:`COLUMNS`."""
    if row.failure:
        return [row.profile, row.failure, *[""] * (len(COLUMNS) - 2)]
    lost = NOT_SEEN if row.commands_lost is None else f"{row.commands_lost:.1%}"
    return [
        row.profile,
        f"{_number(row.command_p50_ms, 0)} / {_number(row.command_p95_ms, 0)}",
        lost,
        f"{_number(row.picture_p50_ms, 0)} / {_number(row.picture_p95_ms, 0)}",
        _number(row.pictures_per_s, 1),
        _number(row.freezes_per_min, 1),
        _number(row.to_operator_mbps, 2),
        _number(row.recovery_s, 1),
        _number(row.connect_s, 2),
        _number(row.first_picture_s, 2),
    ]


def rich_table(rows: Sequence[Figures]) -> Table:
    """For a terminal."""
    table = Table(box=None, pad_edge=False, header_style="bold")
    for name in COLUMNS:
        table.add_column(name, justify="left" if name == "profile" else "right")
    for row in rows:
        table.add_row(*cells(row), style="red" if row.failure else None)
    return table


def markdown_table(rows: Sequence[Figures]) -> str:
    """For a document."""
    lines = [COLUMNS, ["---"] + ["---:"] * (len(COLUMNS) - 1), *map(cells, rows)]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def _number(value: float | None, digits: int) -> str:
    return NOT_SEEN if value is None else f"{value:.{digits}f}"
