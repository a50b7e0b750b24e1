"""How long the command line takes to start, and how much memory a robot holds.

python bench/startup.py [ROUNDS]

Times as ratios to bare Python and to `import aiortc` in the same run; memory beside a process with one data channel of
plain aiortc. Linux alone tells the memory.
"""

from __future__ import annotations

import statistics
import subprocess
import sys
import tempfile
import time
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


def commands(config: Path) -> dict[str, list[str]]:
    mosaic = [sys.executable, "-m", "mosaic_core.cli.main"]
    return {
        "bare python": [sys.executable, "-c", "pass"],
        "import aiortc": [sys.executable, "-c", "import aiortc"],
        "mosaic --help": [*mosaic, "--help"],
        "mosaic connectors list": [*mosaic, "connectors", "list"],
        "mosaic validate (4 connectors)": [*mosaic, "validate", str(config)],
    }


def seconds(command: list[str]) -> float:
    start = time.perf_counter()
    done = subprocess.run(command, capture_output=True, text=True)
    elapsed = time.perf_counter() - start
    if done.returncode != 0:
        raise SystemExit(f"{' '.join(command)} failed:\n{done.stdout}{done.stderr}")
    return elapsed


def taken_s(rounds: int) -> dict[str, list[float]]:
    """Command → seconds, in alternating rounds after one that does not count."""
    with tempfile.TemporaryDirectory() as folder:
        config = Path(folder) / "mosaic_config.yaml"
        config.write_text(CONFIG)
        all_commands = commands(config)
        for command in all_commands.values():
            seconds(command)
        taken: dict[str, list[float]] = {name: [] for name in all_commands}
        for _ in range(rounds):
            for name, command in all_commands.items():
                taken[name].append(seconds(command))
    return taken


def time_table(taken: dict[str, list[float]]) -> Table:
    table = Table(title=f"Start-up, {len(taken['bare python'])} alternating rounds")
    for column in ("command", "median ms", "min", "max", "over bare python", "x import aiortc"):
        table.add_column(column, justify="left" if column == "command" else "right")
    medians = {name: statistics.median(values) for name, values in taken.items()}
    for name, values in taken.items():
        table.add_row(
            name,
            *(f"{1000 * value:.0f}" for value in (medians[name], min(values), max(values))),
            f"{1000 * (medians[name] - medians['bare python']):.0f}",
            f"{medians[name] / medians['import aiortc']:.2f}",
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
    console.print(time_table(taken_s(rounds)))
    console.print(memory_table())


if __name__ == "__main__":
    main()
