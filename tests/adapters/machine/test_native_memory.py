"""Threads share what memory they have freed."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from mosaic_core.adapters.machine import event_loop
from mosaic_core.adapters.machine.event_loop import ARENAS, share_arenas

ON_GLIBC = pytest.mark.skipif(not event_loop._is_glibc(), reason="only glibc has arenas")
THREADS = 6
PROGRAM = f"""
import asyncio, ctypes, sys, threading
from mosaic_core.adapters.machine.event_loop import run_event_loop

libc = ctypes.CDLL(None)
libc.malloc.restype, libc.malloc.argtypes = ctypes.c_void_p, [ctypes.c_size_t]
libc.fopen.restype, libc.fopen.argtypes = ctypes.c_void_p, [ctypes.c_char_p, ctypes.c_char_p]
libc.malloc_info.argtypes, libc.fclose.argtypes = [ctypes.c_int, ctypes.c_void_p], [ctypes.c_void_p]

async def main():
    all_there = threading.Barrier({THREADS})
    def run():
        libc.malloc(1000)
        all_there.wait(10)
    threads = [threading.Thread(target=run) for _ in range({THREADS})]
    for thread in threads: thread.start()
    for thread in threads: thread.join()

run_event_loop(main())
file = libc.fopen(b"/dev/stdout", b"w")
libc.malloc_info(0, file)
libc.fclose(file)
"""


def arenas(**more: str) -> int:
    env = {name: value for name, value in os.environ.items() if name not in ("MALLOC_ARENA_MAX", "GLIBC_TUNABLES")}
    words = [sys.executable, "-c", PROGRAM]
    run = subprocess.run(words, env=env | more, capture_output=True, text=True, timeout=30, check=True)
    return run.stdout.count("<heap nr=")


@ON_GLIBC
def test_the_threads_of_a_program_share_one_arena() -> None:
    assert arenas() == ARENAS


@ON_GLIBC
@pytest.mark.parametrize(("name", "value"), [("MALLOC_ARENA_MAX", "4"), ("GLIBC_TUNABLES", "glibc.malloc.arena_max=4")])
def test_what_the_user_has_said_stands(name: str, value: str) -> None:
    assert arenas(**{name: value}) == 4


def test_another_c_library_is_left_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    def confstr(name: str) -> str:
        raise ValueError(name)

    monkeypatch.setattr(os, "confstr", confstr)
    assert not share_arenas()
