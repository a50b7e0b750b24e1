"""A peer that has vanished is noticed within 16 s, one that is alive and silent is kept.

aioice asks every five seconds, waits half a second for the answer, hears nothing else, and takes 26 to 28 s; aiortc
then says ``closed``, as if the other side had closed the connection.
"""

from __future__ import annotations

import asyncio
import random
from collections.abc import Callable
from time import monotonic
from typing import Any

from aioice import Connection
from aioice.ice import StunProtocol
from aioice.stun import Message, TransactionError
from aiortc import RTCIceTransport

from mosaic_core.machines.peers.consent import Consent
from mosaic_core.runtime.timing.background_tasks import BackgroundTasks

_REPEATS = 2
"""A question is repeated after 0.5 and 1.5 s and may be answered for 3.5 s: longer than any round trip."""


def watch_liveness(transport: RTCIceTransport, lost: Callable[[], None]) -> None:
    """Call ``lost``, once, when the other side has vanished. Before the transport starts."""
    connection = transport._connection
    connection.query_consent = _Liveness(connection, lost).run  # type: ignore[method-assign]


class _Liveness:
    """Takes the place of the ICE connection's ``query_consent``, which it starts as a task once it has a path."""

    def __init__(self, connection: Connection, lost: Callable[[], None]) -> None:
        self._connection = connection
        self._lost = lost
        self._questions = BackgroundTasks()

    async def run(self) -> None:
        consent = Consent(monotonic())
        self._listen(consent)
        try:
            while True:
                await asyncio.sleep(consent.pause_s(monotonic(), random.random()))
                match consent.tick(monotonic()):
                    case "ask":
                        self._ask(consent)
                    case "lost":
                        self._lost()
                        return
        finally:
            self._questions.cancel()

    def _listen(self, consent: Consent) -> None:
        connection = self._connection
        hear, judge = connection.data_received, connection.request_received

        def data_received(data: bytes, component: int) -> None:
            consent.heard(monotonic())
            hear(data, component)

        def request_received(message: Message, addr: tuple[str, int], protocol: StunProtocol) -> None:
            consent.heard(monotonic())
            judge(message, addr, protocol)

        connection.data_received = data_received  # type: ignore[method-assign]
        connection.request_received = request_received  # type: ignore[method-assign]

    def _ask(self, consent: Consent) -> None:
        for pair in self._connection._nominated.values():
            self._questions.start(self._asked(pair, consent))

    async def _asked(self, pair: Any, consent: Consent) -> None:
        connection = self._connection
        assert connection.remote_password is not None
        request = connection.build_request(pair, nominate=False)
        key = connection.remote_password.encode()
        try:
            await pair.protocol.request(request, pair.remote_addr, integrity_key=key, retransmissions=_REPEATS)
        except (TransactionError, OSError):
            return
        consent.answered(monotonic())
