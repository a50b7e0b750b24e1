"""Both kinds of end as the benchmark drives them: a Python process, and a page in Chromium."""

from __future__ import annotations

import asyncio
import json
import os
import sys
from pathlib import Path
from typing import Any, Protocol

BENCH = Path(__file__).parent.parent
ANSWER_S = 60.0


class RemoteEnd(Protocol):
    async def do(self, what: str, **options: Any) -> Any:
        """Give an order of `data_bench.end` and wait for its answer."""
        ...

    async def stop(self) -> None: ...


class ProcessEnd:
    """A Python stack in a process of its own."""

    def __init__(self, process: asyncio.subprocess.Process) -> None:
        self._process = process

    @classmethod
    async def started(cls, stack: str, loop: str) -> ProcessEnd:
        command = [sys.executable, "-m", "data_bench.end", stack, loop]
        environment = {**os.environ, "PYTHONPATH": str(BENCH)}
        pipe = asyncio.subprocess.PIPE
        limit_bytes = 1024 * 1024
        return cls(
            await asyncio.create_subprocess_exec(*command, stdin=pipe, stdout=pipe, env=environment, limit=limit_bytes)
        )

    async def do(self, what: str, **options: Any) -> Any:
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write(json.dumps({"do": what, **options}).encode() + b"\n")
        line = await asyncio.wait_for(self._process.stdout.readline(), ANSWER_S)
        if not line:
            raise SystemExit(f"an end of the connection died while told to {what}")
        return json.loads(line)

    async def stop(self) -> None:
        assert self._process.stdin is not None
        self._process.stdin.close()
        try:
            await asyncio.wait_for(self._process.wait(), 5)
        except TimeoutError:
            self._process.kill()
            await self._process.wait()


class PageEnd:
    """A page of Chromium; it tells no CPU time."""

    def __init__(self, page: Any) -> None:
        self._page = page

    @classmethod
    async def started(cls, browser: Any) -> PageEnd:
        page = await (await browser.new_context()).new_page()
        await page.evaluate((Path(__file__).parent / "page.js").read_text())
        return cls(page)

    async def do(self, what: str, **options: Any) -> Any:
        return await asyncio.wait_for(
            self._page.evaluate("order => window.obey(order)", {"do": what, **options}), ANSWER_S
        )

    async def stop(self) -> None:
        await self._page.context.close()
