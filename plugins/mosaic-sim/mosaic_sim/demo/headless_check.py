"""``--headless-check``: an operator in a process of its own drives the robot, and the supervisor reports."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from collections.abc import Collection, Sequence

from rich.console import Console
from rich.table import Table

from mosaic_sim.demo.checks import Result
from mosaic_sim.demo.demo_robot import YARD
from mosaic_sim.demo.errors import DemoFailed
from mosaic_sim.demo.own_checks import UNPROVEN, owner_of
from mosaic_sim.demo.supervisor import RunningDemo

PATIENCE_S = 90.0
MOST_LOG_LINES = 2000
_FAILURE = re.compile(
    r"(?:WARNING|ERROR) +connector '(?P<label>[^']+)'(?: failed(?: at (?P<place>.*?:\d+)(?: in [\w.<>]+)?)?)?: "
    r"(?P<why>.*?)(?:; tries again in [\d.]+ s)?$",
    re.MULTILINE,
)
"""The line of `mosaic run` about a connector that failed, or whose messages were refused."""
PASSWORD_VARIABLE = "MOSAIC_CHECK_PASSWORD"  # noqa: S105 - the name of a variable, not a password

ANY_ROBOT = "--any-robot"
"""The robot is not that of the yard: each of its connectors is looked at as those of ``--with`` are."""

OF_EVERY_PEER = ("connection-check",)
"""What tells of the link alone has channels of its own kind; that there is a link has been seen by then."""


def checked(demo: RunningDemo) -> list[Result]:
    """The results of ``check_program``; raises :class:`DemoFailed` if it gives none, or a child died meanwhile."""
    labels = [one.label for one in demo.own]
    if demo.shown is not YARD:
        labels = [ANY_ROBOT, *(one.label for one in demo.simulated if one.type not in OF_EVERY_PEER), *labels]
    command = [
        sys.executable, "-m", "mosaic_sim.demo.check_program", demo.url, demo.seed.email, demo.seed.robot_id,
        *labels,
    ]  # fmt: skip
    environment = {**os.environ, PASSWORD_VARIABLE: demo.seed.password}
    try:
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False, timeout=PATIENCE_S)
    except subprocess.TimeoutExpired:
        raise DemoFailed(f"the check did not end within {PATIENCE_S:g} s", details=demo.robot.last_lines()) from None
    demo.check_alive()
    try:
        results = [Result.of_wire(line) for line in json.loads(done.stdout)]
    except (ValueError, TypeError, KeyError):
        raise DemoFailed("the check gave no result", details=done.stderr.strip()[-2000:]) from None
    every = [one.label for one in (*demo.own, *demo.simulated)]
    failures = failures_in(demo.robot.last_lines(MOST_LOG_LINES), every)
    return [with_cause(result, failures.get(result.name, "")) for result in results]


def failures_in(log: str, labels: Collection[str]) -> dict[str, str]:
    """What the robot's log says last of those connectors, or of handlers of theirs, that failed; but first that one
    sends what its class does not declare, which is told once."""
    found: dict[str, str] = {}
    for match in _FAILURE.finditer(log):
        label = owner_of(match["label"], labels)
        if label is not None and not is_authors(found.get(label, "")):
            found[label] = ": ".join(filter(None, (match["place"], match["why"])))
    return found


def is_authors(cause: str) -> bool:
    """Whether it sends what its class does not declare: no other machine makes that good."""
    return "(plugin.wrong_message)" in cause


def with_cause(result: Result, cause: str) -> Result:
    """A device that is missing fails the check of what only takes messages, too; what has arrived is proof enough, but
    not of what was refused beside it."""
    is_proven = result.is_ok and UNPROVEN.isdisjoint(result.detail.split(", "))
    if not cause or (is_proven and not is_authors(cause)):
        return result
    return Result(result.name, False, cause)


def print_results(console: Console, results: Sequence[Result]) -> None:
    table = Table(title="mosaic demo: headless check")
    for column in ("check", "", "seen"):
        table.add_column(column)
    for result in results:
        table.add_row(result.name, "[green]ok[/]" if result.is_ok else "[bold red]failed[/]", result.detail)
    console.print(table)
