"""The stores of data: what arrives goes to subscribers, what is sent goes where the connection says.

All methods and callbacks on the event loop.
"""

from __future__ import annotations

import asyncio
import contextlib
import inspect
import time
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping
from typing import Any

from pydantic import BaseModel

from mosaic_core.machines.delivery.framing import PayloadKind
from mosaic_core.operator.delivery.data_port import MessageInfo, Received
from mosaic_core.operator.delivery.listeners import Complaints, all_heard
from mosaic_core.operator.stores.mosaic_store import MosaicStore
from mosaic_core.operator.stores.robot_connector import RobotConnector
from mosaic_core.runtime.timing.background_tasks import BackgroundTasks
from mosaic_core.words.data_type import MosaicDataType
from mosaic_core.words.wire_model import to_json

Subscriber = Callable[..., Awaitable[None] | None]
Outlet = Callable[[PayloadKind, bytes], bool]
QUEUED_MESSAGES = 1024
"""An iteration that falls further behind loses the oldest: memory stays bounded."""
ARRIVAL_POLL_S = 0.01
"""Acknowledgements come within a round trip, and SCTP calls nobody when one does."""
HELD_PERIOD_S = 0.1
"""A third of the time-out that most of what moves has."""


class ReceivableStore(MosaicStore):
    """Receives what a connector sends."""

    def __init__(self, robot_connector: RobotConnector) -> None:
        super().__init__(robot_connector)
        self.latest: Received | None = None
        self._subscribers: list[tuple[Subscriber, bool]] = []
        self._tasks = BackgroundTasks()
        self._complaints = Complaints()

    @property
    def latest_age_s(self) -> float | None:
        """How old the last message is: since it was made where the clocks are known, else since it arrived. ``None``:
        there was none. While the state is ``reconnecting`` it keeps growing."""
        if self.latest is None:
            return None
        info = self.latest.info
        return time.monotonic() - info.received_at_s + (info.age_s or 0.0)

    def subscribe(self, callback: Subscriber) -> Callable[[], None]:
        """Call ``callback(data)`` or ``callback(data, info)`` with every message (``bytes``); may be ``async``.

        Returns what ends it. An exception in a callback is logged, one in five seconds, and ends nothing.
        """
        entry = (callback, _takes_two(callback))
        self._subscribers.append(entry)
        return lambda: self._subscribers.remove(entry) if entry in self._subscribers else None

    def notify_subscribers(self, data: bytes, info: MessageInfo) -> None:
        """Give a message to everybody; the connection calls it, and tests may."""
        self.latest = Received(data, info)
        for callback, takes_info in list(self._subscribers):
            try:
                result = callback(data, info) if takes_info else callback(data)
            except Exception:  # noqa: BLE001 - one subscriber must not take the message from the others
                self._complain()
                continue
            if inspect.isawaitable(result):
                self._tasks.start(self._guarded(result))

    async def next_message(self, timeout_s: float = 10.0) -> Received:
        """The next message that arrives. Raises :class:`ConnectionFailed` where the connection ends meanwhile, or
        the robot has nothing under this label, and :class:`TimeoutError`."""
        return await self._first_of(self._each, "message", timeout_s)

    def messages(self) -> AsyncIterator[Received]:
        """Every message from now on, for ever."""
        return all_heard(self._each, QUEUED_MESSAGES)

    def _each(self, take: Callable[[Received], None]) -> Callable[[], None]:
        return self.subscribe(lambda data, info: take(Received(data, info)))

    async def _guarded(self, work: Awaitable[None]) -> None:
        try:
            await work
        except Exception:  # noqa: BLE001 - as above
            self._complain()

    def _complain(self) -> None:
        self._complaints.log(f"{self.robot_connector.connector_id}: a subscriber")


class SendableStore(MosaicStore):
    """Sends messages to a connector."""

    def __init__(self, robot_connector: RobotConnector) -> None:
        super().__init__(robot_connector)
        self.last_sent: bytes | None = None
        """The newest message that was accepted."""
        self._outlet: Outlet | None = None
        self._outlives = False
        self._has_arrived: Callable[[], bool] = _never

    def connect_outlet(
        self, outlet: Outlet | None, *, outlives: bool = False, has_arrived: Callable[[], bool] | None = None
    ) -> None:
        """Where to send to; the connection sets it. ``outlives``: it takes messages without a connection too.
        ``has_arrived``: whether the robot's side has acknowledged everything that was sent."""
        self._outlet = outlet
        self._outlives = outlives
        self._has_arrived = has_arrived or _never

    def send_data(self, data: str | bytes | BaseModel | Mapping[str, Any] | list[Any]) -> bool:
        """Send one message: text, bytes, or an object as JSON; ``False`` if it was not accepted (not open, or too much
        is waiting). Raises :class:`ValueError` for an object with NaN in it, and nothing else.

        While the state is ``reconnecting``, messages of a connector with ``delivery: reliable`` that moves nothing are
        accepted into a bounded queue, and go out with the next connection: each arrives once and in order, or
        :meth:`on_gap` tells how many did not.
        """
        if isinstance(data, BaseModel | Mapping | list):
            return self.send_json(data)
        payload = data.encode() if isinstance(data, str) else bytes(data)
        accepted = self._outlet is not None and self._outlet(_kind_of(self.robot_connector.data_type), payload)
        self.counters.refused += not accepted
        if accepted:
            self.last_sent = payload
        return accepted

    @property
    def outlives_connection(self) -> bool:
        """What it sends while the connection is made anew, and what was sent before, still arrives."""
        return self._outlives

    def send_json(self, value: BaseModel | Mapping[str, Any] | list[Any]) -> bool:
        """Send JSON; NaN raises :class:`ValueError`."""
        plain = value.model_dump(mode="json") if isinstance(value, BaseModel) else value
        return self.send_data(to_json(plain))

    @contextlib.asynccontextmanager
    async def held(
        self, target: BaseModel | Mapping[str, Any] | list[Any], period_s: float = HELD_PERIOD_S
    ) -> AsyncIterator[None]:
        """Say ``target`` again and again while the block runs, so that the robot does not take silence for a lost
        operator; after the block, its time-out holds it. ``period_s``: a third of that time-out or less. Leave out a
        target's own duration, which would begin anew each time. Raises as :meth:`send_json`, when the block ends for
        what was said in between; an error of the block itself goes first, with a note of that one."""
        self.send_json(target)
        saying = asyncio.create_task(self._say(target, period_s))
        try:
            yield
        except BaseException as error:
            if failure := await _failure_of(saying):
                error.add_note(f"It was not held to the end: {failure}")
            raise
        if failure := await _failure_of(saying):
            raise failure

    async def _say(self, target: BaseModel | Mapping[str, Any] | list[Any], period_s: float) -> None:
        while True:
            await asyncio.sleep(period_s)
            self.send_json(target)

    async def wait_arrived(self, timeout_s: float = 1.0) -> bool:
        """Until the robot's side has acknowledged what was sent; ``False``: it has not in that time. What the robot's
        program makes of it is another question."""
        loop = asyncio.get_running_loop()
        ends_at_s = loop.time() + timeout_s
        while self.state.phase == "open" and not self._has_arrived() and loop.time() < ends_at_s:  # noqa: ASYNC110
            await asyncio.sleep(ARRIVAL_POLL_S)
        return self.state.phase == "open" and self._has_arrived()

    def end(self) -> None:
        """What was sent was the last: nothing more is accepted before the next connection."""
        self._outlet = None

    def closed(self) -> None:
        self._outlet = None
        super().closed()

    def interrupted(self) -> None:
        if not self._outlives:
            self._outlet = None
        super().interrupted()


class BidirectionalStore(ReceivableStore, SendableStore):
    """Sends and receives on one channel of a connector."""


async def _failure_of(task: asyncio.Task[None]) -> BaseException | None:
    """End the task; why it had ended before by itself, if it had."""
    task.cancel()
    await asyncio.wait([task])
    return None if task.cancelled() else task.exception()


def _never() -> bool:
    return False


def _kind_of(data_type: MosaicDataType | None) -> PayloadKind:
    prefix = (data_type or MosaicDataType.JSON_U2R).value.split("-")[0]
    return {"json": PayloadKind.JSON, "string": PayloadKind.STRING}.get(prefix, PayloadKind.BYTES)


def _takes_two(callback: Subscriber) -> bool:
    with contextlib.suppress(TypeError, ValueError):
        parameters = list(inspect.signature(callback).parameters.values())
        by_position = [p for p in parameters if p.kind in (p.POSITIONAL_ONLY, p.POSITIONAL_OR_KEYWORD)]
        required = [p for p in by_position if p.default is p.empty]
        return len(required) >= 2 or any(p.kind is p.VAR_POSITIONAL for p in parameters)
    return False
