"""``--headless-check``: an operator in a process of its own drives the robot, and the supervisor reports."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from collections.abc import Collection, Mapping, Sequence

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
_BLOCKS = "(plugin.blocks_loop)"
_BLOCK = re.compile(
    r"the event loop (?:was blocked for|is blocked, for) (?P<seconds>[\d.]+) s(?: so far)?, "
    r"by connector '(?P<label>[^']+)': (?P<place>.*?) \(plugin\.blocks_loop\)"
)
"""The line about one whose code holds up all others."""
LONG_BLOCK_S = 0.5
"""On a busy machine an innocent line may take a while once."""
PASSWORD_VARIABLE = "MOSAIC_CHECK_PASSWORD"  # noqa: S105 - the name of a variable, not a password

CONNECT = "connect"
"""The name of the first check."""
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
    return [with_cause(result, cause_of(result, failures)) for result in results]


def failures_in(log: str, labels: Collection[str]) -> dict[str, str]:
    """What the robot's log says last of those connectors, or of handlers of theirs, that failed; but first that one
    sends what its class does not declare, which is told once. Of those that did not fail, whether they block it."""
    found: dict[str, str] = {}
    for match in _FAILURE.finditer(log):
        label = owner_of(match["label"], labels)
        if label is not None and not is_authors(found.get(label, "")):
            found[label] = ": ".join(filter(None, (match["place"], match["why"])))
    for match in _BLOCK.finditer(log):
        label = owner_of(match["label"], labels)
        if label is not None and float(match["seconds"]) >= LONG_BLOCK_S:
            seconds = float(match["seconds"])
            found.setdefault(label, f"{match['place']}: blocks the robot's event loop for {seconds:.1f} s {_BLOCKS}")
    return found


def cause_of(result: Result, failures: Mapping[str, str]) -> str:
    """Whoever blocks the event loop can also keep everybody from connecting."""
    if result.name == CONNECT:
        return "" if result.is_ok else next((cause for cause in failures.values() if _BLOCKS in cause), "")
    return failures.get(result.name, "")


def is_authors(cause: str) -> bool:
    """Whether it sends what its class does not declare, or holds up all others: no other machine makes that good."""
    return "(plugin.wrong_message)" in cause or _BLOCKS in cause


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
