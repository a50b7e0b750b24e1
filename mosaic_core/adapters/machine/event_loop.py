"""Runs a program on uvloop where it is installed, else on asyncio's own loop, in a process that suits it.

Small messages on a data channel travel about ten times faster on uvloop (see ``bench/``).
"""

from __future__ import annotations

import asyncio
import ctypes
import gc
import os
import sys
from collections.abc import Callable, Coroutine
from typing import Any, TypeVar

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


ARENAS = 2
"""One for the first thread and one for all others. Threads seldom wait for each other there: Python has an allocator of
its own, small pieces come from a thread's own cache, and encoders reserve theirs when they begin."""
_M_ARENA_MAX = -8  # malloc.h
_ARENAS_VARIABLE, _TUNABLES_VARIABLE = "MALLOC_ARENA_MAX", "GLIBC_TUNABLES"


def share_arenas() -> bool:
    """Keep what a robot's native memory grows to at what it needs at once, however many encoders come and go: let all
    threads of this process but the first share one arena; whether that was asked for.

    glibc gives threads arenas of their own, eight per core, and an arena keeps what was freed in it. Each encoder runs
    on a new thread, so sooner or later every arena holds the megabytes of an encoder that has ended. Nothing is changed
    where the user has said how many there may be, nor where the C library is another one."""
    if not _is_glibc() or _ARENAS_VARIABLE in os.environ or "arena_max" in os.environ.get(_TUNABLES_VARIABLE, ""):
        return False
    return bool(ctypes.CDLL(None).mallopt(_M_ARENA_MAX, ARENAS))


def _is_glibc() -> bool:
    try:
        return (os.confstr("CS_GNU_LIBC_VERSION") or "").startswith("glibc")
    except (AttributeError, OSError, ValueError):  # Windows; musl; macOS
        return False
