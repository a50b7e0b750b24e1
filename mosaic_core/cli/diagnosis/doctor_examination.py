"""``mosaic doctor``: runs the checks and shows what they found."""

from __future__ import annotations

import json
import logging
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import typer
from rich.console import Console, Group
from rich.live import Live
from rich.spinner import Spinner
from rich.table import Table
from rich.text import Text

from mosaic_core.adapters.machine.event_loop import run_event_loop
from mosaic_core.cli.operator.operator_session import SignIn
from mosaic_core.cli.robot.run_command import make_robot
from mosaic_core.cli.terminal.error_report import FAILED, FINE, need_known, usage
from mosaic_core.cli.terminal.log_output import LogLevel, set_up_logging
from mosaic_core.doctor.config_checks import read_config
from mosaic_core.doctor.examination import Examined, Progress, examined
from mosaic_core.doctor.plan import Plan, Subject
from mosaic_core.doctor.server_checks import ServerAddress
from mosaic_core.doctor.whole_checks import WholeWay
from mosaic_core.machines.diagnosis.first_steps import first_steps
from mosaic_core.runtime.configuration.auto_configurer import AutoConfigurer
from mosaic_core.runtime.configuration.resolver import ConnectorResolver
from mosaic_core.runtime.robot import Robot
from mosaic_core.runtime.threads import slow_code
from mosaic_core.words.config import ConnectorConfig, RobotConfig, ServerConfig
from mosaic_core.words.errors import whole_sentence
from mosaic_core.words.finding import Finding, Status
from mosaic_core.words.plain_text import on_one_line


def examine(
    config: Path | None,
    server: str,
    only: Sequence[str],
    *,
    as_json: bool,
    account: OperatorAccount | None = None,
    resolver: ConnectorResolver | None = None,
) -> int:
    """The exit code. ``account``: make a whole connection as this operator. ``resolver`` knows the file's types."""
    set_up_logging(LogLevel.ERROR)
    if account is not None and config is None:
        usage("--with-server needs the robot's YAML file")
    logging.getLogger(slow_code.__name__).setLevel(logging.WARNING)  # whoever waits wants to know for what
    read = None if config is None else read_config(config, resolver)  # before there is a loop that it would block
    subject = Subject(read, server, frozenset(only), None if account is None else account.way, resolver)
    if as_json:
        result = run_event_loop(_run(subject))
        typer.echo(json_document(result))
    else:
        console = Console(highlight=False, markup=False)
        if console.is_terminal:
            with LiveReport(console) as progress:
                result = run_event_loop(_run(subject, progress))
        else:
            result = run_event_loop(_run(subject))
        print_report(console, result)
    return FAILED if result.has_failed else FINE


@dataclass(frozen=True, slots=True)
class OperatorAccount:
    """The operator of a whole connection."""

    email: str
    code: str

    def way(self, server: ServerConfig) -> WholeWay:
        """To the robot of ``server``, or to a stand-in with its identity."""
        sign_in = SignIn.asked(ServerAddress(server.ws_url).http_url, self.email, self.code, password_stdin=False)
        return WholeWay(str(server.auth.robot_id), sign_in.operator, lambda: _stand_in(server))


def _stand_in(server: ServerConfig) -> Robot:
    """The robot's identity, and the least connector there is."""
    connectors = (ConnectorConfig(type="connection-check", label="doctor"),)
    return make_robot(AutoConfigurer().from_config(RobotConfig(server=server, connectors=connectors)))


async def _run(subject: Subject, progress: Progress | None = None) -> Examined:
    plan = Plan(subject)
    for name in sorted(subject.only):
        if name in _NEEDS and name not in plan.groups:
            usage(f"--only {name} needs {_NEEDS[name]}")
        need_known("group of checks", name, plan.groups)
    return await examined(plan.checks(), progress)


_FILE = "the robot's YAML file"
_NEEDS = {"config": _FILE, "code": _FILE, "device": _FILE, "whole": "--with-server"}


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
    """Shows the checks that run, while they do."""

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
    text = Text(on_one_line(finding.sentence), style="dim" if finding.status == "skipped" else "")
    if finding.status in ("warn", "fail"):
        text.append(f"  {finding.code}", style="dim")
        if finding.cure:
            text.append(f"\n→ {on_one_line(finding.cure)}", style="cyan")
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
        console.print(Text(on_one_line(f" {number}. {whole_sentence(finding.sentence)} {finding.cure}".rstrip())))
