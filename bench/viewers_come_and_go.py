"""Whether a robot keeps anything of operators who left: memory, threads, tasks.

python bench/viewers_come_and_go.py [--minutes M] [--viewers N]

Server and robot are real. Operators connect, see a picture, and leave, over and over; the robot is looked at when
nobody is there, after a warm-up and at the end.
"""

from __future__ import annotations

import argparse
import asyncio
import tempfile
from contextlib import ExitStack
from pathlib import Path

from glass_bench.dashboard import Server
from glass_bench.soak import SIZE, Kept, Soaked, counted_robot, soaked
from processes.mosaic import end_like_ctrl_c
from rich.console import Console
from rich.table import Table

WARM_UP_SHARE = 1 / 3
"""Caches that have a bound fill until about 2 300 operators have come, which takes a quarter of an hour."""


async def measure(folder: Path, stack: ExitStack, viewers: int, minutes: float) -> Soaked:
    server = Server(folder, stack)
    robot = stack.enter_context(counted_robot(server.config(SIZE), server.site.robot_log))
    return await soaked(server, robot, viewers, minutes * 60, minutes * 60 * WARM_UP_SHARE)


def table_of(found: Soaked, minutes: float) -> Table:
    table = Table(title=f"{found.joins} operators in {minutes:g} minutes; the robot when nobody is there")
    for name in ("", "memory MB", "threads", "tasks", "open files"):
        table.add_column(name, justify="right" if name else "left")
    for name, kept in (("before", found.before), ("after", found.after)):
        table.add_row(name, *cells(kept))
    return table


def cells(kept: Kept) -> tuple[str, ...]:
    return f"{kept.rss_mb:.1f}", str(kept.threads), str(kept.tasks), str(kept.files)


def main() -> None:
    end_like_ctrl_c()
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=1.0)
    parser.add_argument("--viewers", type=int, default=4, help="at a time")
    asked = parser.parse_args()
    try:
        with tempfile.TemporaryDirectory() as folder, ExitStack() as stack:
            found = asyncio.run(measure(Path(folder), stack, asked.viewers, asked.minutes))
    except KeyboardInterrupt:
        raise SystemExit("interrupted") from None
    console = Console()
    console.print(table_of(found, asked.minutes))
    grown_mb = found.after.rss_mb - found.before.rss_mb
    share = grown_mb / found.before.rss_mb
    console.print(f"Growth: {share:.1%}, {1000 * grown_mb / found.joins:.1f} KB for each operator who came and left")
    if found.late:
        console.print(f"[red]{found.late} of them saw no picture for half a minute")


if __name__ == "__main__":
    main()
