"""Brings a connection back after it was lost: same session, growing waits with jitter, until it is closed for good."""

from __future__ import annotations

import asyncio
import logging
import random
from collections.abc import Awaitable, Callable

from mosaic_core.machines.backoff import Backoff, BackoffPolicy
from mosaic_core.operator.robot_connection import RobotConnection
from mosaic_core.words.errors import AuthError, ConnectionFailed, MosaicError

_log = logging.getLogger(__name__)

POLICY = BackoffPolicy(first_s=0.3, factor=1.7, max_s=10.0, jitter=0.5)
"""Quick at first: most losses are a change of network that is over when it is noticed."""


async def keep_connected(connection: RobotConnection, reopen: Callable[[], Awaitable[None]]) -> None:
    """Run beside ``connection`` for its life. ``reopen()`` tries once, and raises what went wrong."""
    while await connection.wait_interrupted():
        _log.warning("the connection to robot %s is lost, trying again", connection.robot_id)
        backoff = Backoff(POLICY)
        while connection.state == "reconnecting":
            await asyncio.sleep(backoff.failed(0.0, random.random()))
            try:
                await reopen()
            except AuthError as error:
                connection.give_up(ConnectionFailed(error.message, code=error.code))
            except MosaicError as error:
                _log.debug("not yet: %s", error.message)
        if connection.state == "connected":
            _log.warning("the connection to robot %s is back", connection.robot_id)
