"""Code that never returns is called where nobody waits for it."""

from __future__ import annotations

import asyncio
import threading

import pytest

from mosaic_core.runtime.threads.daemon_call import called_on_daemon


async def test_what_it_returns_comes_back() -> None:
    assert await called_on_daemon(lambda: threading.current_thread().name, "look") == "look"


async def test_what_it_raises_comes_back() -> None:
    with pytest.raises(ValueError, match="'x'"):
        await called_on_daemon(lambda: int("x"), "look")


def test_a_loop_ends_beside_one_that_never_returns_and_hears_nothing_of_it_later() -> None:
    go_on, ended = threading.Event(), threading.Event()

    def hang() -> None:
        go_on.wait()
        ended.set()

    async def impatient() -> None:
        with pytest.raises(TimeoutError):
            await asyncio.wait_for(called_on_daemon(hang, "hang"), 0.01)

    asyncio.run(impatient())
    go_on.set()
    assert ended.wait(5)
