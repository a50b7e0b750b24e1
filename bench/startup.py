"""How long the command line takes to start, and how much memory a robot holds.

python bench/startup.py [ROUNDS]

Times as ratios to bare Python and to `import aiortc` in the same run, and the processor's time, which other work on the
machine changes less; memory beside a process with one data channel of plain aiortc. Linux alone tells the memory.
"""

from __future__ import annotations

import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.table import Table
from startup_bench.memory import measured

CONFIG = """\
server:
  ws_url: ws://127.0.0.1:9001
  auth: { type: no-authorization, robot_id: 7d1c2f6e-0b52-4c1e-9a53-2f6f1f0c9b11 }
connectors:
  - { type: test-pattern, label: front }
  - { type: host-load, label: host }
  - { type: cmd-vel, label: cmd_vel, params: { drive: { type: log } } }
  - { type: connection-check, label: link }
"""


FURTHER_TYPES = 40
DISTRIBUTION = "further_connectors"


@dataclass(frozen=True, slots=True)
class Taken:
    """What one run of a command took."""

    wall_s: float
    cpu_s: float


def commands(config: Path) -> dict[str, list[str]]:
    mosaic = [sys.executable, "-m", "mosaic_core.cli.main"]
    return {
        "bare python": [sys.executable, "-c", "pass"],
        "import aiortc": [sys.executable, "-c", "import aiortc"],
        "mosaic --help": [*mosaic, "--help"],
        f"mosaic connectors list ({FURTHER_TYPES} types more)": [*mosaic, "connectors", "list"],
        "mosaic run --help": [*mosaic, "run", "--help"],
        "mosaic server run --help": [*mosaic, "server", "run", "--help"],
        "mosaic validate (4 connectors)": [*mosaic, "validate", str(config)],
    }


def install_further_types(folder: Path) -> None:
    """A distribution with many connector types, as a folder on the path sees it."""
    names = [f"Further{number}Configurer" for number in range(FURTHER_TYPES)]
    classes = [f'class {name}:\n    """One of many types."""\n\n\n' for name in names]
    (folder / f"{DISTRIBUTION}.py").write_text("".join(classes))
    info = folder / f"{DISTRIBUTION}-1.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {DISTRIBUTION}\nVersion: 1\n")
    points = [f"further-{number} = {DISTRIBUTION}:{name}\n" for number, name in enumerate(names)]
    (info / "entry_points.txt").write_text("[mosaic.connectors]\n" + "".join(points))


def taken_by(command: list[str], folder: Path) -> Taken:
    start_s, start_cpu_s = time.perf_counter(), _childrens_cpu_s()
    done = subprocess.run(command, capture_output=True, text=True, env={**os.environ, "PYTHONPATH": str(folder)})
    taken = Taken(time.perf_counter() - start_s, _childrens_cpu_s() - start_cpu_s)
    if done.returncode != 0:
        raise SystemExit(f"{' '.join(command)} failed:\n{done.stdout}{done.stderr}")
    return taken


def _childrens_cpu_s() -> float:
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def all_taken(rounds: int) -> dict[str, list[Taken]]:
    """What each command took, in alternating rounds after one that does not count."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        install_further_types(folder)
        config = folder / "mosaic_config.yaml"
        config.write_text(CONFIG)
        every = commands(config)
        for command in every.values():
            taken_by(command, folder)
        taken: dict[str, list[Taken]] = {name: [] for name in every}
        for _ in range(rounds):
            for name, command in every.items():
                taken[name].append(taken_by(command, folder))
    return taken


def time_table(taken: dict[str, list[Taken]]) -> Table:
    table = Table(title=f"Start-up, medians of {len(taken['bare python'])} alternating rounds")
    for column in ("command", "ms", "x import aiortc", "processor ms", "over bare python"):
        table.add_column(column, justify="left" if column == "command" else "right")
    wall_s = {name: statistics.median(one.wall_s for one in runs) for name, runs in taken.items()}
    cpu_s = {name: statistics.median(one.cpu_s for one in runs) for name, runs in taken.items()}
    for name in taken:
        table.add_row(
            name,
            f"{1000 * wall_s[name]:.0f}",
            f"{wall_s[name] / wall_s['import aiortc']:.2f}",
            f"{1000 * cpu_s[name]:.0f}",
            f"{1000 * (cpu_s[name] - cpu_s['bare python']):.0f}",
        )
    return table


def memory_table() -> Table:
    table = Table("process", title="Resident memory, MB")
    for column in ("all", "not shared with other processes", "x plain aiortc"):
        table.add_column(column, justify="right")
    plain_mb = None
    for name, resident in measured():
        plain_mb = plain_mb or resident.whole_mb
        table.add_row(name, f"{resident.whole_mb:.0f}", f"{resident.own_mb:.0f}", f"{resident.whole_mb / plain_mb:.2f}")
    return table


def main() -> None:
    rounds = int(sys.argv[1]) if len(sys.argv) > 1 else 5
    console = Console()
    console.print(time_table(all_taken(rounds)))
    console.print(memory_table())


if __name__ == "__main__":
    main()
