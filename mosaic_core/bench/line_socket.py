"""Signaling between two processes of one machine: a frame a line."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import suppress

LINE_BYTES = 1024 * 1024


class LineSocket:
    """Sends and reads signaling frames over a stream, a frame a line; a ``TextSocket``."""

    def __init__(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self.close_code: int | None = None
        self._reader = reader
        self._writer = writer

    async def __aiter__(self) -> AsyncIterator[str]:
        while line := await self._reader.readline():
            yield line.decode().rstrip("\n")
        self.close_code = self.close_code or 1006

    async def send(self, text: str) -> None:
        self._writer.write(text.encode() + b"\n")
        await self._writer.drain()

    async def close(self, code: int = 1000, reason: str = "") -> None:
        self.close_code = code
        self._writer.close()
        with suppress(OSError):
            await self._writer.wait_closed()
