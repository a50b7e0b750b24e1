"""``mosaic doctor``: runs the checks and shows what they found."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import typer
from rich.console import Console

from mosaic_core.adapters.machine.event_loop import run_event_loop
from mosaic_core.cli.diagnosis.doctor_report import LiveReport, json_document, print_report
from mosaic_core.cli.operator.operator_session import SignIn
from mosaic_core.cli.robot.run_command import make_robot
from mosaic_core.cli.terminal.error_report import FAILED, FINE, usage
from mosaic_core.cli.terminal.log_output import LogLevel, set_up_logging
from mosaic_core.doctor.examination import Examined, Progress, examined
from mosaic_core.doctor.plan import Plan, Subject
from mosaic_core.doctor.server_checks import ServerAddress
from mosaic_core.doctor.whole_checks import WholeWay
from mosaic_core.runtime.configuration.auto_configurer import AutoConfigurer
from mosaic_core.runtime.robot import Robot
from mosaic_core.words.config import ConnectorConfig, RobotConfig, ServerConfig


def examine(
    config: Path | None, server: str, only: Sequence[str], *, as_json: bool, account: OperatorAccount | None = None
) -> int:
    """The exit code. ``account``: make a whole connection as this operator."""
    set_up_logging(LogLevel.ERROR)
    if account is not None and config is None:
        usage("--with-server needs the robot's YAML file")
    subject = Subject(config, server, frozenset(only), None if account is None else account.way)
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
    checks = Plan(subject).checks()
    if not checks:
        usage(f"no group of checks is called {', '.join(sorted(subject.only))}")
    return await examined(checks, progress)
