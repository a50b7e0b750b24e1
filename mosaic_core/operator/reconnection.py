"""Brings a connection back after it was lost: same session, the first try at once, then growing waits with jitter,
until it is closed for good.
"""

from __future__ import annotations

import asyncio
import logging
import random
import time
from collections.abc import Awaitable, Callable

from mosaic_core.machines.timing.backoff import Backoff, BackoffPolicy
from mosaic_core.operator.robot_connection import RobotConnection
from mosaic_core.words.errors import AuthError, ConnectionFailed, MosaicError

_log = logging.getLogger(__name__)

POLICY = BackoffPolicy(first_s=0.3, factor=1.7, max_s=10.0, jitter=0.5)
"""Quick at first: most losses are a change of network that is over when it is noticed."""


class Reconnection:
    """Brings one connection back; :meth:`run` beside it for its life. ``reopen()`` tries once, and raises what went
    wrong. ``patience_s``: how long it is tried; ``None``: for ever."""

    def __init__(
        self, connection: RobotConnection, reopen: Callable[[], Awaitable[None]], patience_s: float | None = None
    ) -> None:
        self.connection = connection
        self._reopen = reopen
        self._patience_s = patience_s
        self._woken = asyncio.Event()

    def wake(self) -> None:
        """Something is better now: the network or the robot came back. Try at once."""
        self._woken.set()

    async def run(self) -> None:
        connection = self.connection
        while await connection.wait_interrupted():
            _log.warning("the connection to robot %s is lost, trying again", connection.robot_id)
            await self._bring_back()
            if connection.state == "connected":
                _log.warning("the connection to robot %s is back", connection.robot_id)

    async def _bring_back(self) -> None:
        backoff, begun_s = Backoff(POLICY), time.monotonic()
        while self.connection.state == "reconnecting":
            self._woken.clear()
            try:
                await self._reopen()
            except AuthError as error:
                self.connection.give_up(ConnectionFailed(error.message, code=error.code))
            except MosaicError as error:
                _log.debug("not yet: %s", error.message)
                if self._patience_s is not None and time.monotonic() - begun_s > self._patience_s:
                    self.connection.give_up(ConnectionFailed(error.message, code=error.code, cure=error.cure))
                await self._pause(backoff.failed(0.0, random.random()))

    async def _pause(self, delay_s: float) -> None:
        try:
            async with asyncio.timeout(delay_s):
                await self._woken.wait()
        except TimeoutError:
            return
