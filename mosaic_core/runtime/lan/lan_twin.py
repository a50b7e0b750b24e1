"""The server that a robot runs for its own network: kept alive as a child, its log passed on, its news told.

Robot and server live apart: when the server dies it is started again with back-off and peers do not notice; without
it the robot goes on with its fleet's server.
"""

from __future__ import annotations

import asyncio
import json
import logging
import random
import subprocess
import time
from collections.abc import AsyncIterator, Callable
from typing import IO, Any

from pydantic import ValidationError

from mosaic_core.machines.timing.backoff import Backoff, BackoffPolicy
from mosaic_core.runtime.lan.child_process import ChildProcess
from mosaic_core.runtime.transport.transport import SocketConnector, TextSocket
from mosaic_core.words.errors import SignalingError
from mosaic_core.words.lan import LanChild, LanNews

logger = logging.getLogger(__name__)

LABEL = "lan server: "
_POLICY = BackoffPolicy(first_s=0.5, max_s=30.0)
_MAX_LINE_BYTES = 64 * 1024
_REAP_S = 1.0
"""A child whose outputs are closed has all but ended."""


class LanTwin:
    """Runs the robot's own server as a child process. Event loop only. ``open_socket`` connects to the server once it
    listens; ``on_news`` hears each of its news.
    """

    def __init__(self, child: LanChild, open_socket: SocketConnector, on_news: Callable[[LanNews], None]) -> None:
        self._child = child
        self._open_socket = open_socket
        self._on_news = on_news
        self._serving = asyncio.Event()
        self._ending = asyncio.Event()
        self._process: ChildProcess | None = None
        self._is_missed = False

    @property
    def pid(self) -> int | None:
        """Of the running server."""
        return None if self._process is None else self._process.pid

    async def connect(self, url: str) -> TextSocket:
        """A ``SocketConnector`` that waits until the server listens, however long its start takes."""
        waiting = [asyncio.ensure_future(one.wait()) for one in (self._serving, self._ending)]
        await asyncio.wait(waiting, return_when=asyncio.FIRST_COMPLETED)
        for one in waiting:
            one.cancel()
        if self._ending.is_set():
            raise SignalingError("the robot stops", code="signal.unreachable", cure="")
        return await self._open_socket(url)

    async def run(self) -> None:
        """Keep it alive until :meth:`end`."""
        backoff = Backoff(_POLICY)
        while not self._ending.is_set():
            began_s = time.monotonic()
            what = await self._live()
            if self._ending.is_set():
                return
            delay_s = backoff.failed(time.monotonic() - began_s, random.random())
            self._is_missed = True
            logger.error("%s%s; it starts again in %.1f s", LABEL, what, delay_s)
            try:
                await asyncio.wait_for(self._ending.wait(), delay_s)
            except TimeoutError:
                continue

    def begin_end(self) -> None:
        """Nobody waits for it any more, and it is not started again."""
        self._ending.set()

    def ask_to_end(self) -> None:
        self.begin_end()
        if self._process is not None:
            self._process.ask_to_end()

    def end(self, deadline_s: float) -> None:
        """Gone at ``deadline_s`` of the monotonic clock at the latest. Blocks until then."""
        self.ask_to_end()
        if self._process is not None:
            self._process.end(deadline_s)

    # -- one life ------------------------------------------------------------------------------------------------

    async def _live(self) -> str:
        """From its start to its end; how it ended."""
        pipe = subprocess.PIPE
        try:
            self._process = process = ChildProcess(self._child.command, stdin=pipe, stdout=pipe, stderr=pipe)
        except OSError as error:
            return f"it can't be started: {error.strerror or error}"
        assert process.process.stdout is not None
        assert process.process.stderr is not None
        try:
            await asyncio.gather(self._read_news(process.process.stdout), self._read_log(process.process.stderr))
            await asyncio.to_thread(process.end, time.monotonic() + _REAP_S)
        finally:
            self._serving.clear()
            if process.process.stdin is not None:
                process.process.stdin.close()
        return f"it ended with exit code {process.exit_code}"

    async def _read_news(self, output: IO[bytes]) -> None:
        async for line in _lines(output):
            try:
                news = LanNews.model_validate_json(line)
            except ValidationError:
                logger.warning("%ssaid something unreadable", LABEL)
                continue
            if not self._serving.is_set():
                self._serving.set()
                if self._is_missed:
                    self._is_missed = False
                    logger.info("%sit is there again", LABEL)
            self._on_news(news)

    async def _read_log(self, output: IO[bytes]) -> None:
        async for line in _lines(output):
            _pass_on(line)


def _pass_on(line: str) -> None:
    """A line of the server's log as one of ours: JSON with its level, or whatever Python prints when it dies."""
    if not line.strip():
        return
    try:
        record: Any = json.loads(line)
    except ValueError:
        record = None
    if not isinstance(record, dict):
        logger.error("%s%s", LABEL, line)
        return
    level = logging.getLevelNamesMapping().get(str(record.get("level", "")).upper(), logging.INFO)
    fields = {name: record[name] for name in ("robotId", "peerId", "code") if name in record}
    text = str(record.get("message", ""))
    more = f"\n{record['exception']}" if "exception" in record else ""
    logger.log(level, "%s%s%s", LABEL, text, more, extra=fields)


async def _lines(output: IO[bytes]) -> AsyncIterator[str]:
    """Of a pipe, until its other end is closed; a line that is too long is dropped."""
    loop = asyncio.get_running_loop()
    reader = asyncio.StreamReader(limit=_MAX_LINE_BYTES)
    transport, _ = await loop.connect_read_pipe(lambda: asyncio.StreamReaderProtocol(reader), output)
    try:
        while True:
            try:
                line = await reader.readline()
            except ValueError:
                continue
            if not line:
                return
            yield line.decode(errors="replace").rstrip("\r\n")
    finally:
        transport.close()
