"""`python counted_robot.py CONFIG`: `mosaic run` that also says, as lines of JSON, what it keeps: memory, threads,
tasks, encoders.
"""

from __future__ import annotations

import asyncio
import gc
import json
import logging
import signal
import sys
import threading
from pathlib import Path

from mosaic_core.adapters.machine.event_loop import run_event_loop
from mosaic_core.cli.robot.run_command import make_robot
from mosaic_core.runtime.configuration.auto_configurer import AutoConfigurer

PERIOD_S = 0.25
GARBAGE_EVERY = 8


def kept() -> dict[str, object]:
    names = [thread.name for thread in threading.enumerate()]
    encoders = sorted(name.removeprefix("encode ") for name in names if name.startswith("encode "))
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return {
        "rss_mb": pages * 4096 / 1e6,
        "threads": len(names),
        "tasks": len(asyncio.all_tasks()),
        "files": sum(1 for _ in Path("/proc/self/fd").iterdir()),
        "encoders": encoders,
    }


async def main(config: Path) -> None:
    robot = make_robot(AutoConfigurer().from_file(config))
    asyncio.get_running_loop().add_signal_handler(signal.SIGTERM, robot.stop)
    running = asyncio.create_task(robot.run())
    looks = 0
    while not running.done():
        if looks % GARBAGE_EVERY == 0:
            gc.collect()  # what only waits to be collected has not leaked
        print(json.dumps(kept()), flush=True)
        looks += 1
        await asyncio.wait({running}, timeout=PERIOD_S)
    await running


if __name__ == "__main__":
    logging.basicConfig(level=logging.WARNING)
    run_event_loop(main(Path(sys.argv[1])))
