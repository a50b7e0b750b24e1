"""Runs a program on uvloop where it is installed, else on asyncio's own loop.

Small messages on a data channel travel about ten times faster on uvloop (see ``bench/``).
"""

from __future__ import annotations

import asyncio
import gc
import sys
from collections.abc import Callable, Coroutine
from typing import Any, TypeVar

from mosaic_core.adapters.machine.native_memory import share_arenas

T = TypeVar("T")
SWITCH_INTERVAL_S = 0.0005
"""Python lets a busy thread run for 5 ms before another one gets its turn: that is the event loop's delay beside a busy
handler, and a handler's beside a busy loop."""


def loop_factory() -> Callable[[], asyncio.AbstractEventLoop] | None:
    """What makes the event loop; ``None`` stands for asyncio's default."""
    try:
        import uvloop
    except ImportError:
        return None
    factory: Callable[[], asyncio.AbstractEventLoop] = uvloop.new_event_loop
    return factory


def run_event_loop(main: Coroutine[Any, Any, T]) -> T:
    """``asyncio.run`` on the fastest loop there is; the threads of this process take short turns from now on, and share
    the memory that they have freed."""
    sys.setswitchinterval(SWITCH_INTERVAL_S)
    share_arenas()
    with asyncio.Runner(loop_factory=loop_factory()) as runner:
        return runner.run(main)


def keep_what_is_loaded() -> None:
    """Modules and all else that is here now stay: the garbage collector need not look through them again and again,
    which would hold up the event loop for 40 to 80 ms at a time."""
    gc.collect()
    gc.freeze()
