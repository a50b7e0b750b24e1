"""Feeds a receiver a script: messages, silence, operators who leave. What the robot enforces is enforced here too:
validation before ``handle_data``, the time-out, the safe action.
"""

from __future__ import annotations

import asyncio
import inspect
import json
from collections.abc import Generator, Iterable
from dataclasses import dataclass, field
from typing import Any, TypeAlias

from pydantic import BaseModel

from mosaic_core.contract.handler import DataChannelReceivable, Refused
from mosaic_core.contract.host import Sender
from mosaic_core.machines.watchdog import Watchdog
from mosaic_core.runtime.payload import PayloadReader
from mosaic_core.runtime.receiver import _takes_sender
from mosaic_core.testing.fake_hosts import FakeHost, fake_host

OPERATOR = Sender(peer_id="peer-1", session_id="session-1", operator_id="operator-1", name="Alice")
"""Who sends what a script does not attribute to somebody."""
ANOTHER_OPERATOR = Sender(peer_id="peer-2", session_id="session-2", operator_id="operator-2", name="Bob")


@dataclass(frozen=True, slots=True)
class Silence:
    """Nothing arrives for ``seconds``."""

    seconds: float


@dataclass(frozen=True, slots=True)
class Leaves:
    """This operator's connection ends."""

    sender: Sender = OPERATOR


@dataclass(frozen=True, slots=True)
class From:
    """A message of ``sender``."""

    sender: Sender
    data: Any


Step: TypeAlias = "Silence | Leaves | From | BaseModel | dict[str, Any] | list[Any] | str | bytes"


@dataclass(frozen=True, slots=True)
class MadeSafe:
    """``make_safe`` ran: seconds since the script began, and why."""

    at_s: float
    cause: str


@dataclass(frozen=True, slots=True)
class RefusedMessage:
    """A message that was refused: before ``handle_data`` or by it."""

    at_s: float
    code: str
    message: str


@dataclass(slots=True)
class Fed:
    """What became of a script."""

    accepted: list[Any] = field(default_factory=list)
    """The messages that ``handle_data`` took, as it got them."""
    refused: list[RefusedMessage] = field(default_factory=list)
    made_safe: list[MadeSafe] = field(default_factory=list)


def feed(handler: DataChannelReceivable[Any], script: Iterable[Step]) -> Fed:
    """Play ``script`` on the fake clock and say what happened.

    ``dict``, ``list`` and models are sent as JSON; ``str`` and ``bytes`` exactly as they are, so that broken JSON can
    be sent too. While ``handle_data`` waits with ``self.pause``, time passes and the time-out may strike, as on a
    robot (there on another thread). An error other than :class:`Refused` is raised here: on a robot it would end the
    handler.
    """
    feeder = _Feeder(handler, fake_host(handler))
    feeder.host.clock.watch(feeder)
    try:
        if inspect.iscoroutinefunction(handler.handle_data):
            asyncio.run(_play_async(feeder, script))
        else:
            for step in script:
                for _ in feeder.steps(step):
                    raise TypeError("handle_data returned an awaitable; write it as `async def`")
    finally:
        feeder.host.clock.forget(feeder)
    return feeder.fed


async def _play_async(feeder: _Feeder, script: Iterable[Step]) -> None:
    for step in script:
        playing = feeder.steps(step)
        for waiting in playing:
            try:
                await waiting
            except Exception as error:  # noqa: BLE001 - handed to the feeder, which knows what it means
                with_error = error
            else:
                continue
            try:
                playing.throw(with_error)
            except StopIteration:
                break


class _Feeder:
    """Plays the steps; also the alarm that rings at the time-out."""

    def __init__(self, handler: DataChannelReceivable[Any], host: FakeHost) -> None:
        self.host = host
        self.fed = Fed()
        self._handler = handler
        timeout_s = host.timeout_s if host.timeout_s is not None else handler.timeout_s
        self._watchdog = Watchdog(timeout_s)
        self._reader = PayloadReader(handler)
        self._takes_sender = _takes_sender(handler)
        self._start_s = host.clock.now_s
        self._is_handling = False
        self._overtaken_cause: str | None = None

    @property
    def due_at_s(self) -> float | None:
        return self._watchdog.due_at_s

    def ring(self, now_s: float) -> None:
        if self._watchdog.expire(now_s):
            self._make_safe("safety.timeout")

    def steps(self, step: Step) -> Generator[Any, None, None]:
        """Play one step; yields what ``async def handle_data`` returned, to be awaited."""
        match step:
            case Silence(seconds):
                self.host.clock.advance(seconds)
            case Leaves(sender):
                if self._watchdog.peer_left(sender.peer_id):
                    self._make_safe("safety.peer_left")
                self._handler.peer_left(sender)
            case From(sender, data):
                yield from self._message(sender, data)
            case _:
                yield from self._message(OPERATOR, step)

    def _message(self, sender: Sender, data: Any) -> Generator[Any, None, None]:
        try:
            value = self._reader.read(_payload(data))
            self._watchdog.feed(sender.peer_id, self.host.clock.now_s)
            self._is_handling, self._overtaken_cause = True, None
            arguments = (value, sender) if self._takes_sender else (value,)
            waiting = self._handler.handle_data(*arguments)
            if waiting is not None:
                yield waiting
        except Refused as refused:
            self.fed.refused.append(RefusedMessage(self._elapsed_s(), refused.code, refused.message))
        else:
            self.fed.accepted.append(value)
        finally:
            self._is_handling = False
        if self._overtaken_cause is not None:
            # The command may have undone the safe action that ran in its middle.
            self._make_safe(self._overtaken_cause)

    def _make_safe(self, cause: str) -> None:
        if self._is_handling:
            self._overtaken_cause = cause
        self.fed.made_safe.append(MadeSafe(self._elapsed_s(), cause))
        self._handler.make_safe(cause)

    def _elapsed_s(self) -> float:
        """To the microsecond, so that a test can write ``0.3`` and mean it."""
        return round(self.host.clock.now_s - self._start_s, 6)


def _payload(data: Any) -> bytes:
    if isinstance(data, bytes):
        return data
    if isinstance(data, str):
        return data.encode()
    plain = data.model_dump(mode="json") if isinstance(data, BaseModel) else data
    return json.dumps(plain).encode()
