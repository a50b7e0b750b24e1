"""How findings look: as they come on a terminal, then by group, and at the end what to do first."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

from rich.console import Console, Group
from rich.live import Live
from rich.spinner import Spinner
from rich.table import Table
from rich.text import Text

from mosaic_core.doctor.examination import Examined, Progress
from mosaic_core.machines.diagnosis.first_steps import first_steps
from mosaic_core.words.finding import Finding, Status

JSON_VERSION = 1
_MARKS: dict[Status, tuple[str, str]] = {
    "ok": ("✓", "green"),
    "warn": ("!", "yellow"),
    "fail": ("✗", "red"),
    "skipped": ("–", "dim"),
}
TITLES = {
    "config": "Configuration",
    "machine": "This machine",
    "install": "What is installed",
    "network": "Network",
    "server": "Server",
    "ice": "STUN, TURN, NAT",
    "webrtc": "Peer connections",
    "relay": "Through TURN",
    "video": "Video encoders",
    "device": "Devices",
    "whole": "The whole way",
}


class LiveReport(Progress):
    """What is being looked at, while it is."""

    def __init__(self, console: Console) -> None:
        self._live = Live(console=console, transient=True, refresh_per_second=8)
        self._running: list[str] = []
        self._bad = 0

    def __enter__(self) -> LiveReport:
        self._live.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._live.stop()

    def began(self, name: str) -> None:
        self._running.append(name)
        self._show()

    def found(self, finding: Finding) -> None:
        self._bad += finding.status == "fail"
        self._show()

    def ended(self, name: str) -> None:
        self._running.remove(name)
        self._show()

    def _show(self) -> None:
        names = ", ".join(dict.fromkeys(_title(name).lower() for name in self._running))
        failed = f"  ({self._bad} failed)" if self._bad else ""
        self._live.update(Group(Spinner("dots", text=f"looking at: {names}{failed}")))


def print_report(console: Console, examined: Examined) -> None:
    """Everything, in the order of the checks."""
    groups: dict[str, list[Finding]] = {}
    for finding in examined.findings:
        groups.setdefault(finding.group, []).append(finding)
    for name, findings in groups.items():
        console.print(Text(_title(name), style="bold"))
        console.print(_table(findings))
    _print_end(console, examined)


def json_document(examined: Examined) -> str:
    """Stable: keys are only ever added while ``version`` stays."""
    document: dict[str, Any] = {
        "version": JSON_VERSION,
        "ok": not examined.has_failed,
        "tookS": round(examined.took_s, 2),
        "findings": [finding.wire() for finding in examined.findings],
        "first": [finding.wire() for finding in first_steps(examined.findings)],
    }
    return json.dumps(document, indent=2, ensure_ascii=False)


def _title(name: str) -> str:
    return TITLES.get(name, name.capitalize())


def _table(findings: Sequence[Finding]) -> Table:
    table = Table(box=None, show_header=False, pad_edge=False, padding=(0, 1))
    table.add_column(width=3, justify="right")
    table.add_column(ratio=1)
    for finding in findings:
        mark, style = _MARKS[finding.status]
        table.add_row(Text(mark, style=style), _text(finding))
    return table


def _text(finding: Finding) -> Text:
    text = Text(finding.sentence, style="dim" if finding.status == "skipped" else "")
    if finding.status in ("warn", "fail"):
        text.append(f"  {finding.code}", style="dim")
        if finding.cure:
            text.append(f"\n→ {finding.cure}", style="cyan")
    return text


def _print_end(console: Console, examined: Examined) -> None:
    count = {status: sum(one.status == status for one in examined.findings) for status in _MARKS}
    said = f"{count['ok']} fine, {count['warn']} warnings, {count['fail']} failed, {count['skipped']} skipped"
    console.print()
    console.print(Text(f"{said} ({examined.took_s:.1f} s)", style="bold red" if count["fail"] else "bold"))
    steps = first_steps(examined.findings)
    if not steps:
        return
    console.print(Text("What to do first", style="bold"))
    for number, finding in enumerate(steps, 1):
        console.print(Text(f" {number}. {finding.sentence} {finding.cure}".rstrip()))
