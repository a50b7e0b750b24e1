"""The table that ``mosaic run`` shows on a terminal: how the robot stands to its server, a row per connector, and below
them what did not arrive, with the reason.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from mosaic_core.words.plain_text import on_one_line

if TYPE_CHECKING:
    from mosaic_core.runtime.observation.counters import ConnectorSnapshot, PeerSnapshot, RobotSnapshot

_STATE_STYLES = {
    "running": "green", "ready": "green", "waiting": "dim", "connecting": "yellow", "offline": "yellow",
    "failed": "bold red", "ended": "dim", "stopped": "dim",
}  # fmt: skip
_COLUMNS = ("connector", "type", "state", "peers", "rate", "data", "queue", "drops", "age", "speed")
_REASONS = {
    "dropped": "full", "too_large": "too large", "lost": "lost", "refused": "refused", "thinned": "thinned",
    "replaced": "replaced",
}  # fmt: skip
"""The counters of messages that did not arrive, in words; what happens by design comes last."""
_BLOCKED_SHOWN_S = 60.0
_ROOMY = 100
"""On a terminal narrower than this (80 is usual) the types, which the file names too, make room for the numbers."""


def robot_table(snapshot: RobotSnapshot, width: int = _ROOMY) -> RenderableType:
    """Everything worth seeing of ``snapshot`` on so many columns."""
    is_narrow = width < _ROOMY
    table = Table(box=None, pad_edge=False, header_style="bold", padding=(0, 1 if is_narrow else 2, 0, 0))
    shown = [index for index, name in enumerate(_COLUMNS) if name != "type" or not is_narrow]
    for index in shown:
        table.add_column(_COLUMNS[index], justify="left" if index < 3 else "right", no_wrap=True)
    for connector in snapshot.connectors:
        row = _row(connector)
        table.add_row(*(row[index] for index in shown))
    return Group(*_headlines(snapshot), table, *_failures(snapshot.connectors), *_reasons(snapshot.connectors))


def _headlines(snapshot: RobotSnapshot) -> tuple[Text, ...]:
    return (
        Text.assemble(*_servers(snapshot), ("up ", "dim"), duration(snapshot.uptime_s)),
        Text.assemble(("robot ", "dim"), snapshot.robot_id, *_control(snapshot)),
        *_stopped(snapshot),
        *_blocked(snapshot),
    )


def _servers(snapshot: RobotSnapshot) -> list[str | tuple[str, str]]:
    """Each server with how the robot stands to it."""
    words: list[str | tuple[str, str]] = []
    for server in snapshot.servers:
        name = "server " if server.name == "fleet" else f"{server.name} "
        words += [(name, "dim"), server.url, "  ", (server.state, _STATE_STYLES.get(server.state, "")), "  "]
    return words


def _control(snapshot: RobotSnapshot) -> list[str | tuple[str, str]]:
    """Who commands what, who asks for it, and who watches."""
    holders = {lease.holder_id for lease in snapshot.leases if lease.holder_id is not None}
    words: list[str | tuple[str, str]] = []
    for lease in snapshot.leases:
        if lease.holder_id is not None:
            words += [(f"  {lease.resource} ", "dim"), (lease.holder, "green")]
        if lease.waiting:
            words += [("  asking ", "dim"), (", ".join(lease.waiting), "yellow")]
    watching = [_name(peer) for peer in snapshot.peers if peer.peer_id not in holders]
    is_held = bool(holders)
    return [*words, ("  watching " if is_held else "  operators ", "dim"), ", ".join(watching) or "none"]


def _name(peer: PeerSnapshot) -> str:
    name = peer.name or peer.operator_id or peer.peer_id[:8]
    return f"{name} (original)" if peer.is_original else name


def _stopped(snapshot: RobotSnapshot) -> list[Text]:
    stop = snapshot.stop
    if stop is None:
        return []
    because = f": {stop.reason}" if stop.reason else ""
    text = f"STOPPED by {stop.by or 'an operator'}{because}, {duration(stop.for_s)} ago; no command acts until cleared"
    return [Text(text, style="bold red")]


def _blocked(snapshot: RobotSnapshot) -> list[Text]:
    """Whose code held up the event loop a moment ago."""
    loop = snapshot.loop
    if loop is None or loop.ago_s > _BLOCKED_SHOWN_S:
        return []
    who = loop.last_label or "no connector's code"
    held = f"event loop blocked for {loop.last_duration_s:.1f} s by {who} ({loop.last_place}), "
    return [Text(f"{held}{duration(loop.ago_s)} ago", style="bold red")]


def _speed(factor: float | None) -> Text:
    """What is left of the commander's speed."""
    if factor is None:
        return Text("–", style="dim")
    return Text(f"{factor:.0%}", style="" if factor >= 1 else "yellow" if factor > 0 else "bold red")


def _queue(connector: ConnectorSnapshot) -> Text:
    """How many messages wait, and how much that is where it counts."""
    if not connector.queue_messages:
        return Text("–", style="dim")
    much = f" {size(connector.queue_bytes)}" if connector.queue_bytes >= 1000 else ""
    return Text(f"{connector.queue_messages}{much}", style="yellow" if connector.queue_messages > 1 else "")


def _drops(connector: ConnectorSnapshot) -> dict[str, int]:
    """How many messages did not arrive, by reason."""
    counts = {word: getattr(connector, name) for name, word in _REASONS.items()}
    return {word: count for word, count in counts.items() if count}


def _reasons(connectors: tuple[ConnectorSnapshot, ...]) -> list[Text]:
    """``drops   front 3 full, 2 lost · scan 7 thinned``, the same for what was resent; nothing where all is well."""
    drops = [
        (connector.label, ", ".join(f"{count} {word}" for word, count in _drops(connector).items()))
        for connector in connectors
    ]
    resent = [(connector.label, str(connector.resent or "")) for connector in connectors]
    lines = []
    for lead, told in (("drops   ", drops), ("resent  ", resent)):
        words = [(label, counts) for label, counts in told if counts]
        if words:
            shown = [Text.assemble((f"{label} ", "dim"), (counts, "yellow")) for label, counts in words]
            lines.append(Text.assemble((lead, "dim"), Text(" · ", style="dim").join(shown)))
    return lines


def _row(connector: ConnectorSnapshot) -> list[Text]:
    state = Text(connector.state, style=_STATE_STYLES.get(connector.state, ""))
    if connector.state == "failed" and _is_absent(connector):
        state = Text("no device", style="yellow")
    drops = sum(_drops(connector).values())
    return [
        Text(connector.label),
        Text(connector.type, style="dim"),
        state,
        Text(str(connector.peers)),
        Text(f"{connector.rate_hz:.1f}/s"),
        Text(f"{size(connector.bytes_per_s)}/s"),
        _queue(connector),
        Text(str(drops), style="yellow" if drops else "dim"),
        Text("–" if connector.age_s is None else duration(connector.age_s)),
        _speed(connector.limit_factor),
    ]


def _failures(connectors: tuple[ConnectorSnapshot, ...]) -> Iterator[Text]:
    """``front    no such camera: /dev/video0 (plugin.no_device), tries again in 8 s``, a line for each that fails."""
    for connector in connectors:
        if connector.state == "failed" and connector.tries_again_in_s is not None:
            why = (on_one_line(connector.last_error), "yellow" if _is_absent(connector) else "red")
            again = f" ({connector.failure_code}), tries again in {math.ceil(connector.tries_again_in_s)} s"
            yield Text.assemble((f"{connector.label}  ", "dim"), why, (again, "dim"), no_wrap=True, overflow="ellipsis")


def _is_absent(connector: ConnectorSnapshot) -> bool:
    """Its device is not there; the plugin is well."""
    return connector.failure_code == "plugin.no_device"


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
