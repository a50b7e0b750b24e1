"""The table that ``mosaic run`` shows on a terminal: a row per connector, and how the robot stands to its server."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

if TYPE_CHECKING:
    from mosaic_core.runtime.counters import ConnectorSnapshot, RobotSnapshot

_STATE_STYLES = {
    "running": "green", "ready": "green", "waiting": "dim", "connecting": "yellow", "offline": "yellow",
    "failed": "bold red", "ended": "dim", "stopped": "dim",
}  # fmt: skip
_COLUMNS = ("connector", "type", "state", "peers", "rate", "data", "drops", "age")


def robot_table(snapshot: RobotSnapshot, server: str) -> RenderableType:
    """Everything worth seeing of ``snapshot``; ``server`` is the URL in the first line."""
    table = Table(box=None, pad_edge=False, header_style="bold")
    for name in _COLUMNS:
        table.add_column(name, justify="left" if name in _COLUMNS[:3] else "right", no_wrap=True)
    for connector in snapshot.connectors:
        table.add_row(*_row(connector))
    return Group(*_headlines(snapshot, server), table)


def _headlines(snapshot: RobotSnapshot, server: str) -> tuple[Text, Text]:
    operators = ", ".join(peer.name or peer.operator_id or peer.peer_id[:8] for peer in snapshot.peers)
    state = (snapshot.state, _STATE_STYLES.get(snapshot.state, ""))
    return (
        Text.assemble(("server ", "dim"), server, "  ", state, ("  up ", "dim"), duration(snapshot.uptime_s)),
        Text.assemble(("robot ", "dim"), snapshot.robot_id, ("  operators ", "dim"), operators or "none"),
    )


def _row(connector: ConnectorSnapshot) -> list[Text]:
    state = Text(connector.state, style=_STATE_STYLES.get(connector.state, ""))
    if connector.state == "failed" and connector.last_error:
        state.append(f" {connector.last_error[:40]}", style="red")
    drops = connector.dropped + connector.refused
    return [
        Text(connector.label),
        Text(connector.type, style="dim"),
        state,
        Text(str(connector.peers)),
        Text(f"{connector.rate_hz:.1f}/s"),
        Text(f"{size(connector.bytes_per_s)}/s"),
        Text(str(drops), style="yellow" if drops else "dim"),
        Text("–" if connector.age_s is None else duration(connector.age_s)),
    ]


def size(count: float) -> str:
    """``1.5 MB``."""
    for unit in ("B", "KB", "MB"):
        if count < 1000:
            return f"{count:.0f} {unit}" if unit == "B" else f"{count:.1f} {unit}"
        count /= 1000
    return f"{count:.1f} GB"


def duration(seconds: float) -> str:
    """``0.3 s``, ``4 min``, ``2 h``."""
    if seconds < 60:
        return f"{seconds:.1f} s" if seconds < 10 else f"{seconds:.0f} s"
    minutes = seconds / 60
    return f"{minutes:.0f} min" if minutes < 60 else f"{minutes / 60:.1f} h"
