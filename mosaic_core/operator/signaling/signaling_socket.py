"""Carries out what ``machines.operator_signaling`` decides: one socket at a time, for as long as the operator lives."""

from __future__ import annotations

import asyncio
import logging
import random
from collections.abc import Callable, Iterable
from contextlib import suppress

from mosaic_core.machines.signaling import operator_signaling as machine
from mosaic_core.machines.signaling.signaling_events import (
    ChangeState,
    CloseSocket,
    ConnectFailed,
    FrameReceived,
    NetworkChanged,
    ReconnectAfter,
    Report,
    SendSignal,
    SocketClosed,
    SocketOpened,
)
from mosaic_core.runtime.signaling.socket_renewal import SocketRenewal
from mosaic_core.runtime.timing.machine_driver import MachineDriver
from mosaic_core.runtime.transport.transport import SocketConnector, TextSocket
from mosaic_core.words.codes import CloseCode, reason
from mosaic_core.words.errors import AuthError, SignalingError
from mosaic_core.words.signaling import SignalingMessage

_log = logging.getLogger(__name__)

MAX_QUEUED = 512
"""Messages that wait for a server which takes none: far more than a minute of offers and candidates for every robot.
Beyond it the connection is given up and made anew, so that memory stays bounded."""
PROBE_S = 0.7
"""A server that is there answers at once."""
FAREWELL_S = 0.5
"""How long the last messages may take to leave."""


class SignalingSocket:
    """``deliver`` gets the messages, on the event loop. Start it with :meth:`start`, end it with :meth:`close`."""

    def __init__(
        self, url: str, access_token: str, connect: SocketConnector, deliver: Callable[[SignalingMessage], None]
    ) -> None:
        self.session = machine.OperatorSignaling(access_token, random.random)
        self._driver = MachineDriver(self.session, self._carry_out)
        self._url = url
        self._connect = connect
        self._deliver = deliver
        self._outgoing: asyncio.Queue[str] = asyncio.Queue(MAX_QUEUED)
        self._reconnect_after_s = 0.0
        self._changed = asyncio.Event()
        self._renewal = SocketRenewal(lambda socket: socket.close())
        self._frames = 0
        self._closing: asyncio.Future[CloseSocket] | None = None
        """What ends the present socket."""
        self._problem: tuple[str, str] | None = None
        self._task: asyncio.Task[None] | None = None

    def start(self) -> None:
        if self._task is None:
            self._task = asyncio.create_task(self._run())

    async def wait_ready(self, timeout_s: float) -> None:
        """Until messages can be sent; raises :class:`AuthError` or :class:`SignalingError` with the last cause."""
        try:
            async with asyncio.timeout(timeout_s):
                while self.session.state not in ("ready", "stopped"):
                    self._changed.clear()
                    await self._changed.wait()
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
        if not self._queued(message):
            raise SignalingError("The server takes no more messages.", code="signal.too_slow")

    def subscribe(self, robot_ids: Iterable[str]) -> None:
        self._driver.tell(machine.RobotsWatched(tuple(robot_ids)))

    async def assured(self, timeout_s: float) -> None:
        """Until messages can be sent to a server that has just shown to be there: a socket that lost its network does
        not know it. Raises as :meth:`wait_ready`."""
        heard = self._frames
        if self.session.state == "ready":
            self._driver.tell(machine.ServerDoubted())
            with suppress(TimeoutError):
                async with asyncio.timeout(PROBE_S):
                    while self._frames == heard and self.session.state == "ready":
                        self._changed.clear()
                        await self._changed.wait()
            if self._frames == heard and self.session.state == "ready":
                self.renew()
        while self._renewal.is_due and self.session.state == "ready":  # noqa: ASYNC110 - the old socket is left at once
            await asyncio.sleep(0)
        await self.wait_ready(timeout_s)

    def renew(self) -> None:
        """The network is another one: leave the socket, which may be dead without knowing it; make a new one now."""
        self._renewal.ask()

    async def close(self) -> None:
        """Send what is queued, then end."""
        if self.session.state == "ready":
            with suppress(TimeoutError):
                async with asyncio.timeout(FAREWELL_S):
                    await self._outgoing.join()
        if self._task is not None:
            self._task.cancel()
            with suppress(asyncio.CancelledError):
                await self._task
            self._task = None
        self._driver.stop()
        await self._renewal.all_left()

    async def _run(self) -> None:
        while self.session.state != "stopped":
            try:
                socket = await self._renewal.opened(self._connect(self._url))
            except SignalingError as error:
                self._driver.tell(ConnectFailed(error.message, error.code))
            else:
                if socket is None:
                    self._driver.tell(NetworkChanged())
                else:
                    await self._serve(socket)
                    self._driver.tell(SocketClosed(socket.close_code))
            with suppress(TimeoutError):
                async with asyncio.timeout(self._reconnect_after_s):
                    await self._renewal.asked()
                    self._driver.tell(NetworkChanged())

    async def _serve(self, socket: TextSocket) -> None:
        self._outgoing = asyncio.Queue(MAX_QUEUED)
        self._closing = closing = asyncio.get_running_loop().create_future()
        self._driver.tell(SocketOpened())
        works = (self._read(socket), self._write(socket), self._close_when_told(socket, closing))
        tasks = [asyncio.create_task(work) for work in works]
        is_moved = False
        try:
            is_moved = not await self._renewal.until_done(*tasks)
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)
            await self._leave(socket, is_moved=is_moved)

    async def _leave(self, socket: TextSocket, *, is_moved: bool) -> None:
        if not is_moved:
            await socket.close()
            return
        self._driver.tell(NetworkChanged())
        self._renewal.leave(socket)

    async def _read(self, socket: TextSocket) -> None:
        async for text in socket:
            self._frames += 1
            self._changed.set()
            self._driver.tell(FrameReceived(text))

    async def _write(self, socket: TextSocket) -> None:
        with suppress(SignalingError):
            while True:
                await socket.send(await self._outgoing.get())
                self._outgoing.task_done()

    @staticmethod
    async def _close_when_told(socket: TextSocket, closing: asyncio.Future[CloseSocket]) -> None:
        request = await closing
        await socket.close(request.code, request.reason)

    def _close_socket(self, request: CloseSocket) -> None:
        if self._closing is not None and not self._closing.done():
            self._closing.set_result(request)

    def _queued(self, message: SignalingMessage) -> bool:
        try:
            self._outgoing.put_nowait(message.to_text())
        except asyncio.QueueFull:
            self._close_socket(CloseSocket(CloseCode.TOO_SLOW, "signal.too_slow"))
            return False
        return True

    def _carry_out(self, effect: machine.Effect) -> None:
        match effect:
            case SendSignal(message):
                self._queued(message)
            case machine.Deliver(message):
                self._deliver(message)
            case CloseSocket():
                self._close_socket(effect)
            case ReconnectAfter(delay_s):
                self._reconnect_after_s = delay_s
            case Report(code, message):
                self._problem = (code, message)
                _log.warning("%s", message)
            case ChangeState():
                self._changed.set()
