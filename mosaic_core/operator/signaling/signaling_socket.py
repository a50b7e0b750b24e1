"""The operator's socket to its server: one at a time, for as long as the operator lives."""

from __future__ import annotations

import asyncio
import logging
import random
from collections.abc import Callable, Iterable
from contextlib import suppress

from mosaic_core.machines.signaling import operator_signaling as machine
from mosaic_core.machines.signaling.signaling_events import ChangeState, CloseSocket, FrameReceived, Report, SendSignal
from mosaic_core.runtime.signaling.signaling_socket import SignalingSocket
from mosaic_core.runtime.transport.transport import SocketConnector
from mosaic_core.words.codes import CloseCode, reason
from mosaic_core.words.errors import AuthError, SignalingError
from mosaic_core.words.signaling import SignalingMessage

_log = logging.getLogger(__name__)

PROBE_S = 0.7
"""A server that is there answers at once."""
FAREWELL_S = 0.5
"""How long the last messages may take to leave."""


class OperatorSignalingSocket(SignalingSocket):
    """Keeps one WebSocket of an operator to a server. ``deliver`` gets the messages, on the event loop. Start it with
    :meth:`start`, end it with :meth:`close`.
    """

    max_unsent = 512
    """Messages that wait for a server which takes none: far more than a minute of offers and candidates for every
    robot. Beyond it the connection is given up and made anew, so that memory stays bounded."""

    def __init__(
        self, url: str, access_token: str, connect: SocketConnector, deliver: Callable[[SignalingMessage], None]
    ) -> None:
        self.session = machine.OperatorSignaling(access_token, random.random)
        super().__init__(url, self.session, connect, self._noted)
        self._deliver = deliver
        self._changed = asyncio.Event()
        self._frames = 0
        self._problem: tuple[str, str] | None = None
        self._task: asyncio.Task[None] | None = None
        self._closing: asyncio.Task[None] | None = None

    def start(self) -> None:
        if self._task is None:
            self._task = asyncio.create_task(self.run())

    async def wait_ready(self, timeout_s: float) -> None:
        """Until messages can be sent; raises :class:`AuthError` or :class:`SignalingError` with the last cause."""
        try:
            async with asyncio.timeout(timeout_s):
                while self.session.state not in ("ready", "stopped"):
                    await self._change()
        except TimeoutError:
            code, message = self._problem or ("signal.timeout", reason("signal.timeout").sentence)
            raise SignalingError(message, code=code) from None
        if self.session.state == "stopped":
            code, message = self._problem or ("auth.failed", reason("auth.failed").sentence)
            raise AuthError(message, code=code)

    def send(self, message: SignalingMessage) -> None:
        """Queue a message; raises :class:`SignalingError` while the server isn't there, or takes no more."""
        if self.session.state != "ready":
            raise SignalingError("The server isn't connected.", code="signal.unreachable")
        is_full = self._unsent.full()
        self._enqueue(SendSignal(message))
        if is_full:
            raise SignalingError("The server takes no more messages.", code="signal.too_slow")

    def subscribe(self, robot_ids: Iterable[str]) -> None:
        self.tell(machine.RobotsWatched(tuple(robot_ids)))

    async def assured(self, timeout_s: float) -> None:
        """Until messages can be sent to a server that has just shown to be there: a socket that lost its network does
        not know it. Raises as :meth:`wait_ready`."""
        heard = self._frames
        if self.session.state == "ready":
            self.tell(machine.ServerDoubted())
            with suppress(TimeoutError):
                async with asyncio.timeout(PROBE_S):
                    while self._frames == heard and self.session.state == "ready":
                        await self._change()
            if self._frames == heard and self.session.state == "ready":
                self.renew()
        while self._renewal.is_due and self.session.state == "ready":  # noqa: ASYNC110 - the old socket is left at once
            await asyncio.sleep(0)
        await self.wait_ready(timeout_s)

    async def close(self) -> None:
        """Send what is queued, then end."""
        if self.session.state == "ready":
            with suppress(TimeoutError):
                async with asyncio.timeout(FAREWELL_S):
                    await self._unsent.join()
        for task in (self._task, self._closing):
            if task is not None:
                task.cancel()
                with suppress(asyncio.CancelledError):
                    await task
        self._task = None
        self._driver.stop()
        await self._renewal.all_left()

    async def _change(self) -> None:
        self._changed.clear()
        await self._changed.wait()

    def _enqueue(self, effect: SendSignal | CloseSocket) -> None:
        if self._unsent.full():
            effect = CloseSocket(CloseCode.TOO_SLOW, "signal.too_slow")
        if isinstance(effect, SendSignal):
            super()._enqueue(effect)
        elif self._socket is not None and (self._closing is None or self._closing.done()):
            # past the queue, which may wait for a server that reads nothing any more
            self._closing = asyncio.create_task(self._socket.close(effect.code, effect.reason))

    def tell(self, event: object) -> None:
        if isinstance(event, FrameReceived):
            self._frames += 1
            self._changed.set()
        super().tell(event)

    def _noted(self, effect: machine.Deliver | ChangeState | Report) -> None:
        match effect:
            case machine.Deliver(message):
                self._deliver(message)
            case Report(code, message):
                self._problem = (code, message)
                _log.warning("%s", message)
            case ChangeState():
                self._changed.set()
