"""From the click to the first value and the first picture through coturn: both sides behind symmetric NATs, in network
namespaces of their own.

sudo .venv/bin/python bench/through_turn.py [ROUNDS]

The laboratory is that of tests/netlab. The first of the four TURN URLs that everybody is given is dead. Between the
namespaces there is no delay: what is measured is what MOSAIC adds. Everybody connects once before it counts.
"""

from __future__ import annotations

import math
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path

from rich.console import Console
from rich.table import Table

sys.path.extend(str(Path(__file__).parents[1] / "tests" / room) for room in (".", "netlab"))

from laboratory.browser import signed_in, visit
from laboratory.fleet import Fleet, run_fleet
from laboratory.nats import NatLab
from laboratory.turn_server import Coturn, run_coturn

PROMISED_S = 3.0
START_S = 60.0
CHROMIUMS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
Times = list[tuple[float, float]]


def wait_for(
    condition: Callable[[], bool],
    what: str,
    timeout_s: float = START_S,
    *,
    alive: subprocess.Popen[bytes] | None = None,
    log: list[str] | None = None,
) -> float:
    start_s = time.monotonic()
    while not condition():
        if time.monotonic() - start_s > timeout_s or (alive is not None and alive.poll() is not None):
            raise SystemExit(f"waited in vain until {what}")
        time.sleep(0.02)
    return time.monotonic() - start_s


def by_python(fleet: Fleet, coturn: Coturn, rounds: int) -> Times:
    os.environ["SSL_CERT_FILE"] = str(coturn.certificate)

    async def body() -> Times:
        found = []
        async with await fleet.signed_in() as operator:
            for _ in range(rounds + 1):
                attempt = await fleet.attempt(operator, with_picture=True)
                found.append((attempt.data_s, attempt.frame_s or math.inf))
        return found[1:]

    times: Times = fleet.lab.on_operators_side(body)
    return times


def by_chromium(fleet: Fleet, program: str, rounds: int) -> Times:
    def person() -> Times:
        with signed_in(fleet, program) as page:
            visits = [visit(fleet, page) for _ in range(rounds + 1)][1:]
        if any("relay" not in one.pair for one in visits):
            raise SystemExit("Chromium found a way around the relay: the figures would mean nothing")
        return [(one.data_s, one.frame_s) for one in visits]

    return fleet.lab.networks["operator"].run(person)


def rank(values: list[float], share: float) -> float:
    return sorted(values)[math.ceil(share * len(values)) - 1]


def table_of(found: dict[str, Times], rounds: int) -> Table:
    table = Table(title=f"Click to first value and first picture through coturn; {rounds} each")
    for name in ("operator", "first", "p50 ms", "p95 ms", "max ms", f"p95 ≤ {PROMISED_S:.0f} s"):
        table.add_column(name, justify="left" if name in ("operator", "first") else "right")
    for operator, times in found.items():
        for what, values in zip(("value", "picture"), zip(*times, strict=True), strict=True):
            figures = (statistics.median(values), rank(list(values), 0.95), max(values))
            kept = "kept" if figures[1] <= PROMISED_S else "MISSED"
            table.add_row(operator, what, *(f"{1000 * value:.0f}" for value in figures), kept)
    return table


def main() -> None:
    rounds = int(sys.argv[1]) if len(sys.argv) > 1 else 20
    console = Console(width=100)
    console.print(f"Load of this machine before: {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
    with tempfile.TemporaryDirectory() as temporary, ExitStack() as stack:
        folders = [Path(temporary, name) for name in ("coturn", "fleet")]
        for folder in folders:
            folder.mkdir()
        lab = NatLab(stack)
        coturn = run_coturn(lab, folders[0], stack, wait_for)
        fleet = run_fleet(lab, coturn, folders[1], stack, wait_for)
        found = {"Python": by_python(fleet, coturn, rounds)}
        program = next((path for name in CHROMIUMS if (path := shutil.which(name))), None)
        if program is None:
            console.print("The rows of Chromium are missing: no Chromium found.")
        else:
            found["Chromium"] = by_chromium(fleet, program, rounds)
    console.print(table_of(found, rounds))
    if any(rank([frame_s for _, frame_s in times], 0.95) > PROMISED_S for times in found.values()):
        raise SystemExit("the first picture took too long")


if __name__ == "__main__":
    main()
