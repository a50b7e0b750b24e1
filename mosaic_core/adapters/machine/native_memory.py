"""Keeps what a robot's native memory grows to at what it needs at once, however many encoders come and go.

glibc gives threads arenas of their own, eight per core, and an arena keeps what was freed in it. Each encoder runs on a
new thread, so sooner or later every arena holds the megabytes of an encoder that has ended.
"""

from __future__ import annotations

import ctypes
import os

ARENAS = 2
"""One for the first thread and one for all others. Threads seldom wait for each other there: Python has an allocator of
its own, small pieces come from a thread's own cache, and encoders reserve theirs when they begin."""
_M_ARENA_MAX = -8  # malloc.h
_ARENAS_VARIABLE, _TUNABLES_VARIABLE = "MALLOC_ARENA_MAX", "GLIBC_TUNABLES"


def share_arenas() -> bool:
    """Let all threads of this process but the first share one arena; whether that was asked for. Nothing is changed
    where the user has said how many there may be, nor where the C library is another one."""
    if not _is_glibc() or _ARENAS_VARIABLE in os.environ or "arena_max" in os.environ.get(_TUNABLES_VARIABLE, ""):
        return False
    return bool(ctypes.CDLL(None).mallopt(_M_ARENA_MAX, ARENAS))


def _is_glibc() -> bool:
    try:
        return (os.confstr("CS_GNU_LIBC_VERSION") or "").startswith("glibc")
    except (AttributeError, OSError, ValueError):  # Windows; musl; macOS
        return False
