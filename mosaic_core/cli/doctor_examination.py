"""``mosaic doctor``: runs the checks and shows what they found."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import typer
from rich.console import Console

from mosaic_core.adapters.event_loop import run_event_loop
from mosaic_core.cli.doctor_report import LiveReport, json_document, print_report
from mosaic_core.cli.error_report import FAILED, FINE
from mosaic_core.cli.log_output import LogLevel, set_up_logging
from mosaic_core.cli.operator_session import usage
from mosaic_core.doctor.examination import Examined, Progress, examined
from mosaic_core.doctor.plan import Plan, Subject


def examine(config: Path | None, server: str, only: Sequence[str], *, as_json: bool) -> int:
    """The exit code."""
    set_up_logging(LogLevel.ERROR)
    subject = Subject(config, server, frozenset(only))
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


async def _run(subject: Subject, progress: Progress | None = None) -> Examined:
    checks = Plan(subject).checks()
    if not checks:
        usage(f"no group of checks is called {', '.join(sorted(subject.only))}")
    return await examined(checks, progress)
