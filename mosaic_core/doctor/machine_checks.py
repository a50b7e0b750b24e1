"""The machine itself: Python, disk, kernel limits, and whether the event loop keeps time."""

from __future__ import annotations

import asyncio
import os
import platform
import shutil
import sys
import threading
import time
from collections.abc import AsyncIterator
from pathlib import Path

from platformdirs import user_data_path

from mosaic_core.words.finding import Finding, failed, passed, skipped, warned

LEAST_PYTHON = (3, 11)
TESTED_MACHINES = {"x86_64", "aarch64", "amd64", "arm64"}
WANTED_RMEM_BYTES = 4 * 1024 * 1024
"""What ``adapters.aiortc_private.ice.gathering`` asks for."""
LEAST_FREE_BYTES = 1024**3
LAG_PERIOD_S, LAG_SAMPLES = 0.005, 200
LAG_LIMIT_MS = 20.0
"""Command pings are compared with 100 ms limits; a loop that is later than this spoils them."""


async def machine_checks() -> AsyncIterator[Finding]:
    """Everything about the machine that takes no time."""
    yield _python()
    yield _platform()
    yield _disk(data_folder())
    yield _udp_buffer()
    yield _real_time()


def _python() -> Finding:
    found = platform.python_version()
    if sys.version_info < LEAST_PYTHON:
        return failed("machine.python", "check.old_python", f"Python {found} is too old.")
    return passed("machine.python", f"{platform.python_implementation()} {found}.", version=found)


def _platform() -> Finding:
    system, machine = platform.system(), platform.machine()
    facts = {"system": system, "machine": machine, "release": platform.release()}
    shown = f"{system} {platform.release()} on {machine}"
    if system != "Linux" or machine.lower() not in TESTED_MACHINES:
        text = f"{shown}: robots are tested on Linux, on x86_64 and aarch64."
        return warned("machine.platform", "check.odd_platform", text, facts=facts)
    return passed("machine.platform", f"{shown}.", **facts)


def data_folder() -> Path:
    """Where servers and robots' own servers keep their data: ``MOSAIC_DATA_DIR``, else where the system has it."""
    told = os.environ.get("MOSAIC_DATA_DIR")
    return Path(told) if told else user_data_path("mosaic", appauthor=False)


def _disk(folder: Path) -> Finding:
    """Of the folder where data goes, or the nearest one above that exists."""
    existing = next(path for path in (folder, *folder.parents) if path.exists())
    free = shutil.disk_usage(existing).free
    facts = {"folder": str(folder), "freeBytes": free}
    shown = f"{free / 1024**3:.1f} GiB free for {folder}"
    if free < LEAST_FREE_BYTES:
        return warned("machine.disk", "check.disk_full", f"Only {shown}.", facts=facts)
    return passed("machine.disk", f"{shown}.", **facts)


def _udp_buffer(path: Path = Path("/proc/sys/net/core/rmem_max")) -> Finding:
    try:
        allowed = int(path.read_text())
    except (OSError, ValueError):
        return skipped("machine.udp_buffer", "The kernel does not tell its largest receive buffer.")
    if allowed < WANTED_RMEM_BYTES:
        text = f"The kernel allows receive buffers of {allowed // 1024} KiB; bursts of data need 4096 KiB."
        return warned("machine.udp_buffer", "check.small_udp_buffer", text, facts={"bytes": allowed})
    return passed("machine.udp_buffer", f"Receive buffers may have {allowed // 1024} KiB.", bytes=allowed)


def _real_time() -> Finding:
    """Tried on a thread that ends at once: the priority is the thread's alone."""
    if sys.platform != "linux":
        return skipped("machine.realtime", "Only Linux has real-time priorities for us.")
    from mosaic_core.runtime.threads.thread_priority import run_first

    allowed: list[bool] = []
    thread = threading.Thread(target=lambda: allowed.append(run_first()), name="priority check")
    thread.start()
    thread.join()
    if not allowed[0]:
        return warned("machine.realtime", "check.no_realtime")
    return passed("machine.realtime", "Safety threads may run before ordinary ones.")


async def loop_lag_check() -> AsyncIterator[Finding]:
    """How late the event loop is while a thread takes the interpreter, as a camera's handler does."""
    stop = threading.Event()
    load = threading.Thread(target=_load, args=(stop,), name="load of the lag check", daemon=True)
    load.start()
    try:
        lags_ms = sorted([await _lag_ms() for _ in range(LAG_SAMPLES)])
    finally:
        stop.set()
        load.join()
    p95_ms = lags_ms[int(0.95 * len(lags_ms))]
    facts = {"medianMs": round(lags_ms[len(lags_ms) // 2], 2), "p95Ms": round(p95_ms, 2), "cores": os.cpu_count()}
    if p95_ms > LAG_LIMIT_MS:
        text = f"Under load the event loop is {p95_ms:.0f} ms late (p95)."
        yield warned("machine.loop_lag", "check.slow_loop", text, facts=facts)
    else:
        yield passed("machine.loop_lag", f"Under load the event loop is {p95_ms:.1f} ms late (p95).", **facts)


async def _lag_ms() -> float:
    due_s = time.perf_counter() + LAG_PERIOD_S
    await asyncio.sleep(LAG_PERIOD_S)
    return max(0.0, (time.perf_counter() - due_s) * 1000)


def _load(stop: threading.Event) -> None:
    while not stop.is_set():
        sum(range(2_000))
