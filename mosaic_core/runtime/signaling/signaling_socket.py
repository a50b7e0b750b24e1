"""Carries out a signaling session over a socket: connects, reads, writes in order, waits, connects again."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Coroutine
from typing import Any

from mosaic_core.machines.signaling import signaling_events as events
from mosaic_core.runtime.timing.background_tasks import BackgroundTasks
from mosaic_core.runtime.timing.machine_driver import Machine, MachineDriver
from mosaic_core.runtime.transport.transport import SocketConnector, TextSocket
from mosaic_core.words.errors import SignalingError


class SocketRenewal:
    """Replaces a socket by a new one when the network changes. Event loop only. ``close`` says good-bye on a socket,
    which may take as long as it likes.
    """

    def __init__(self, close: Callable[[TextSocket], Coroutine[Any, Any, None]]) -> None:
        self._close = close
        self._asked = asyncio.Event()
        self._farewells = BackgroundTasks()

    @property
    def is_due(self) -> bool:
        """Asked for, and not yet begun."""
        return self._asked.is_set()

    def ask(self) -> None:
        """The network is another one: leave the socket, which may be dead without knowing it; make a new one now."""
        self._asked.set()

    async def opened(self, opening: Coroutine[Any, Any, TextSocket]) -> TextSocket | None:
        """The new socket; ``None``: the network changed before it was there. Raises what ``opening`` raises."""
        self._asked.clear()
        task, is_there = asyncio.create_task(opening), False
        try:
            is_there = await self.until_done(task)
        finally:
            if not is_there:
                task.cancel()
                task.add_done_callback(self._leave_late)
        return task.result() if is_there else None

    async def until_done(self, *tasks: asyncio.Task[Any]) -> bool:
        """Until one of them is done; ``False``: the network changed before. Cancelled, it cancels them."""
        asked = asyncio.create_task(self._asked.wait())
        try:
            await asyncio.wait({asked, *tasks}, return_when=asyncio.FIRST_COMPLETED)
        except asyncio.CancelledError:
            for task in tasks:
                task.cancel()
            raise
        finally:
            asked.cancel()
        return any(task.done() for task in tasks)

    def leave(self, socket: TextSocket) -> None:
        """Without waiting for it: whoever is out of reach answers nothing."""
        self._farewells.start(self._close(socket))

    async def all_left(self) -> None:
        """Until the last good-bye is said."""
        await self._farewells.done()

    def _leave_late(self, opening: asyncio.Task[TextSocket]) -> None:
        """It may have opened in the very moment in which nobody wanted it any more."""
        if not opening.cancelled() and opening.exception() is None:
            self.leave(opening.result())


logger = logging.getLogger(__name__)

_CLOSE_PATIENCE_S = 0.5
"""For the closing handshake; a dead server does not answer it."""


class SignalingSocket:
    """Keeps a socket to one server while the robot, or the operator, lives. Event loop only. ``carry_out`` gets every
    effect of ``machine`` that isn't about the socket."""

    max_unsent = 1024
    """Messages that wait for a slow server; the oldest one goes for one more."""

    def __init__(
        self, url: str, machine: Machine[Any, Any], connect: SocketConnector, carry_out: Callable[[Any], None]
    ) -> None:
        self._url = url
        self._connect = connect
        self._carry_out = carry_out
        self._driver = MachineDriver(machine, self._do)
        self._socket: TextSocket | None = None
        self._unsent: asyncio.Queue[events.SendSignal | events.CloseSocket] = asyncio.Queue()
        self._delay_s = 0.0
        self._stopped = asyncio.Event()
        self._renewal = SocketRenewal(lambda socket: _close(socket, 1000, ""))

    def tell(self, event: Any) -> None:
        """Something happened: on the socket, or in the robot."""
        self._driver.tell(event)

    def _do(self, effect: Any) -> None:
        match effect:
            case events.SendSignal() | events.CloseSocket():
                self._enqueue(effect)
            case events.ReconnectAfter(delay_s):
                self._delay_s = delay_s
            case _:
                if effect == events.ChangeState("stopped"):
                    self._stopped.set()
                self._carry_out(effect)

    def renew(self) -> None:
        """The network is another one: leave the socket, which may be dead without knowing it; make a new one now."""
        self._renewal.ask()

    async def run(self) -> None:
        """Until the session is stopped."""
        while not self._stopped.is_set():
            try:
                socket = await self._renewal.opened(self._connect(self._url))
            except SignalingError as error:
                self.tell(events.ConnectFailed(error.message, error.code))
            else:
                if socket is None:
                    self.tell(events.NetworkChanged())
                else:
                    self.tell(events.SocketClosed(await self._serve(socket)))
            await self._wait()

    async def _wait(self) -> None:
        stopped = asyncio.create_task(self._stopped.wait())
        try:
            async with asyncio.timeout(self._delay_s):
                if not await self._renewal.until_done(stopped):
                    self.tell(events.NetworkChanged())
        except TimeoutError:
            return
        finally:
            stopped.cancel()

    async def _serve(self, socket: TextSocket) -> int | None:
        """Until it is closed, or left; the code of its end."""
        self._socket, self._unsent = socket, asyncio.Queue(self.max_unsent)
        reader = asyncio.create_task(self._read(socket))
        writer = asyncio.create_task(self._write(socket, self._unsent))
        self.tell(events.SocketOpened())
        is_moved = False
        try:
            is_moved = not await self._renewal.until_done(reader, writer)
        finally:
            self._socket = None
            code = None if not writer.done() or writer.cancelled() or writer.exception() else writer.result()
            reader.cancel()
            writer.cancel()
            await asyncio.wait({reader, writer})
            await self._leave(socket, is_moved=is_moved)
        return socket.close_code if code is None else code

    async def _leave(self, socket: TextSocket, *, is_moved: bool) -> None:
        if not is_moved:
            await _close(socket, 1000, "")
            return
        self.tell(events.NetworkChanged())
        self._renewal.leave(socket)

    async def _read(self, socket: TextSocket) -> None:
        try:
            async for text in socket:
                self.tell(events.FrameReceived(text))
        except SignalingError as error:
            logger.debug("signaling socket: %s", error)

    async def _write(self, socket: TextSocket, unsent: asyncio.Queue[events.SendSignal | events.CloseSocket]) -> int:
        """The close code that we chose."""
        while True:
            effect = await unsent.get()
            if isinstance(effect, events.CloseSocket):
                await _close(socket, effect.code, effect.reason)
                return effect.code
            await socket.send(effect.message.to_text())
            unsent.task_done()

    def _enqueue(self, effect: events.SendSignal | events.CloseSocket) -> None:
        if self._socket is None:
            return
        if self._unsent.full():
            self._unsent.get_nowait()  # the server stopped reading: its keep-alive ends the socket
        self._unsent.put_nowait(effect)


async def _close(socket: TextSocket, code: int, reason: str) -> None:
    try:
        await asyncio.wait_for(socket.close(code, reason), _CLOSE_PATIENCE_S)
    except (TimeoutError, SignalingError):
        logger.debug("the signaling socket did not close in time")
