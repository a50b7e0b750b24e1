"""One end in a process of its own: reads an order per line, answers with a line."""

from __future__ import annotations

import asyncio
import json
import sys
import time
from typing import Any

from data_bench.stacks import STACKS, Stack
from mosaic_core.adapters.machine.event_loop import run_event_loop

AT_ONCE = 32
"""Messages after which a flooding sender lets the others on its loop work."""


class End:
    def __init__(self, stack: Stack) -> None:
        self._stack = stack
        self._stack.received = self._received
        self._messages = 0
        self._bytes = 0
        self._is_echoing = False
        self._echoed: asyncio.Queue[float] = asyncio.Queue()
        self._flood: asyncio.Task[None] | None = None

    def _received(self, data: bytes) -> None:
        self._messages += 1
        self._bytes += len(data)
        if self._is_echoing:
            self._stack.send(data)
        elif not self._flood:
            self._echoed.put_nowait(time.perf_counter())

    async def obey(self, order: dict[str, Any]) -> Any:
        stack = self._stack
        match order["do"]:
            case "offer":
                return await stack.offer()
            case "answer":
                return await stack.answer(order["sdp"])
            case "accept":
                return await stack.accept(order["sdp"])
            case "opened":
                return await stack.opened()
            case "echo":
                self._is_echoing = True
            case "flood":
                self._flood = asyncio.create_task(self._send_all(bytes(order["size_bytes"])))
            case "count":
                return [self._messages, self._bytes, time.monotonic(), time.process_time()]
            case "ping":
                return await self._ping(order["rate_hz"], order["count"], bytes(order["size_bytes"]))
            case "close":
                if self._flood is not None:
                    self._flood.cancel()
                await stack.close()
        return None

    async def _send_all(self, data: bytes) -> None:
        while True:
            for _ in range(AT_ONCE):
                while not self._stack.send(data):
                    await self._stack.has_room()
            await asyncio.sleep(0)

    async def _ping(self, rate_hz: float, count: int, data: bytes) -> list[float]:
        """Round trips in ms: on an ordered channel the answers come in the order of the questions."""
        while not self._echoed.empty():
            self._echoed.get_nowait()
        sent = []
        start_s = time.perf_counter()
        for number in range(count):
            await asyncio.sleep(max(0.0, start_s + number / rate_hz - time.perf_counter()))
            sent.append(time.perf_counter())
            self._stack.send(data)
        return [1000 * (await self._echoed.get() - at_s) for at_s in sent]


async def serve(stack: str) -> None:
    end = End(STACKS[stack]())
    while line := await asyncio.to_thread(sys.stdin.readline):
        answer = await end.obey(json.loads(line))
        print(json.dumps(answer), flush=True)


if __name__ == "__main__":
    _, stack_name, loop_name = sys.argv
    if loop_name == "uvloop":
        run_event_loop(serve(stack_name))
    else:
        asyncio.run(serve(stack_name))
