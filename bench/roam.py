"""How long an operator is without control and data when a network changes, and whether anything is lost.

    sudo .venv/bin/python bench/roam.py [--changes 10]

Robot, server and operator are processes in network namespaces (``tests/netlab/laboratory``): needs root. Each change is
one of: another address of the operator, another address of the robot, another cable of the robot (Wi-Fi to the mobile
network), another cable of the operator. The time counts from the change to the first command that moves the robot
again, and to the first message that arrives again. At the end the server is restarted, which nobody shall notice.
"""

from __future__ import annotations

import argparse
import asyncio
import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import ExitStack
from itertools import pairwise
from pathlib import Path
from typing import Any

sys.path.extend(str(Path(__file__).parents[1] / "tests" / room) for room in (".", "netlab"))

from laboratory.forwarding import Lab
from laboratory.roaming import Roamer, RoamingSite, roaming_site

from mosaic_core.operator import MosaicOperator

CHANGES = ("operator: other address", "robot: other address", "robot: other cable", "operator: other cable")
CALM_S = 3.0
"""Between two changes: everything is as before the first."""
Row = tuple[str, float, float]


def change_of(site: RoamingSite, name: str) -> Callable[[], float]:
    side, _, what = name.partition(": ")
    action = site.cables.move if what == "other address" else site.cables.switch
    return lambda: action("robot" if side == "robot" else "operator")


async def measured(site: RoamingSite, changes: int) -> tuple[list[Row], Roamer, float]:
    rows: list[Row] = []
    async with MosaicOperator(site.url, await site.token(), is_person=True) as operator:
        connection = await operator.connect(site.account["robotId"], timeout_s=20, reconnect=True)
        roamer = Roamer(site, connection)
        await roamer.begin()
        for number in range(changes):
            await asyncio.sleep(CALM_S)
            name = CHANGES[number % len(CHANGES)]
            since_s = await asyncio.to_thread(change_of(site, name))
            data_s, control_s = await roamer.back_after(since_s, 30.0)
            rows.append((name, data_s, control_s))
            print(f"{name:<26} data {data_s:5.2f} s   control {control_s:5.2f} s", flush=True)
        pause_s = await restarted(site, roamer)
        await roamer.end()
        await asyncio.sleep(1.5)
    return rows, roamer, pause_s


async def restarted(site: RoamingSite, roamer: Roamer) -> float:
    """The longest pause of the data while the server restarts."""
    await asyncio.sleep(CALM_S)
    begin_s = time.monotonic()
    await asyncio.to_thread(site.server.stop)
    await asyncio.to_thread(site.start_server)
    await asyncio.sleep(CALM_S)
    times_s = [at_s for at_s in roamer.at_s if at_s >= begin_s]
    return max((later - earlier for earlier, later in pairwise(times_s)), default=float("inf"))


def report(rows: list[Row], roamer: Roamer, pause_s: float) -> None:
    print(f"\n{'change':<26} {'n':>3} {'data p50':>9} {'p95':>6} {'control p50':>12} {'p95':>6}")
    for name in (*CHANGES, "all"):
        chosen = [row for row in rows if name in ("all", row[0])]
        if chosen:
            figures = [_quantiles([row[column] for row in chosen]) for column in (1, 2)]
            (data, data95), (control, control95) = figures
            print(f"{name:<26} {len(chosen):>3} {data:>8.2f}s {data95:>5.2f}s {control:>11.2f}s {control95:>5.2f}s")
    noted = roamer.site.noted()
    print(f"\nserver restart: longest pause of the data {pause_s * 1000:.0f} ms")
    print(f"robot -> operator: {len(roamer.numbers)} messages, {_flaws(roamer.numbers)}")
    print(
        f"operator -> robot: {len(roamer.written)} accepted, {len(noted)} arrived, {_flaws(noted)}; gaps {roamer.gaps}"
    )


def _quantiles(values: list[float]) -> tuple[float, float]:
    ordered = sorted(values)
    return statistics.median(ordered), ordered[min(len(ordered) - 1, round(0.95 * (len(ordered) - 1)))]


def _flaws(numbers: list[int]) -> str:
    missing = (numbers[-1] - numbers[0] + 1 - len(set(numbers))) if numbers else 0
    order = "in order" if numbers == sorted(numbers) else "OUT OF ORDER"
    return f"{len(numbers) - len(set(numbers))} twice, {missing} missing, {order}"


def wait_for(condition: Callable[[], Any], what: str, timeout_s: float = 30.0) -> None:
    ends_at_s = time.monotonic() + timeout_s
    while not condition():
        if time.monotonic() > ends_at_s:
            raise TimeoutError(what)
        time.sleep(0.02)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--changes", type=int, default=10)
    arguments = parser.parse_args()
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        site = roaming_site(Lab(stack), folder, stack, wait_for)
        rows, roamer, pause_s = site.lab.operator.run(lambda: asyncio.run(measured(site, arguments.changes)))
        report(rows, roamer, pause_s)


if __name__ == "__main__":
    main()
