"""Makes the second peer connection of a robot and an operator: bulk data only, so that commands never wait behind it.

What both ends do alike is here; the robot answers (``bulk_of_robot``), the operator offers
(``operator.peers.bulk_of_operator``). Signaling runs over the control channel of the main connection, so that the
server need not be there; the second one lives no longer than that, and carries neither control nor media.
"""

from __future__ import annotations

import logging
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any, Generic, Protocol, TypeVar

from mosaic_core.machines.peers.peer_events import BulkCloseHeard, BulkFailed, DropBulk, TellBulkClosed
from mosaic_core.runtime.timing.background_tasks import BackgroundTasks
from mosaic_core.runtime.timing.machine_driver import Machine, MachineDriver
from mosaic_core.words.control import ControlMessage, LaneAnswer, LaneCandidate, LaneClose, LaneOffer
from mosaic_core.words.signaling import IceCandidate

logger = logging.getLogger(__name__)

LaneMessage = LaneOffer | LaneAnswer | LaneCandidate | LaneClose


class BulkEnd(Protocol):
    """One end of the peer connection itself: an ``Answerer`` or an ``Offerer``."""

    async def add_candidate(self, candidate: IceCandidate) -> None: ...
    async def close(self) -> None: ...


AnyBulkEnd = TypeVar("AnyBulkEnd", bound=BulkEnd)


class BulkAttempt(Generic[AnyBulkEnd]):
    """Carries one attempt, under its number: what it tells after its end, nobody hears."""

    def __init__(self, attempt: int, connection: BulkConnection[Any]) -> None:
        self.attempt = attempt
        self.end: AnyBulkEnd | None = None
        self.is_closed = False
        self._connection = connection
        self._early: list[IceCandidate] | None = []

    def describe(self, message: LaneOffer | LaneAnswer) -> None:
        """Say our description, and after it the candidates that were found meanwhile."""
        self._connection.say(message)
        early, self._early = self._early or [], None
        for candidate in early:
            self.candidate_found(candidate)

    def fail(self, code: str = "", message: str = "") -> None:
        """It can't be made, or is gone."""
        if not self.is_closed:
            self._connection.tell(BulkFailed(self.attempt, code, message))

    async def add_candidate(self, candidate: IceCandidate) -> None:
        """One of the other side."""
        if self.end is not None:
            await self.end.add_candidate(candidate)

    async def close(self) -> None:
        """End it; doing so twice does nothing more. Never raises."""
        self.is_closed = True
        if self.end is None:
            return
        try:
            await self.end.close()
        except Exception:  # it is over either way, but whoever looks for a leak must find it
            logger.warning("a second connection did not close cleanly", exc_info=True)

    # -- what the transport tells --------------------------------------------------------------------------------

    def candidate_found(self, candidate: IceCandidate) -> None:
        if self._early is not None:
            self._early.append(candidate)
        elif not self.is_closed:
            self._connection.say(LaneCandidate.of(self.attempt, candidate))

    def state_changed(self, state: str) -> None:
        if state in ("failed", "closed"):
            self.fail()


Attempt = TypeVar("Attempt", bound=BulkAttempt[Any])


class BulkConnection(ABC, Generic[Attempt]):
    """Drives the machine of one side, and keeps the attempt that lives. Event loop only.

    ``say`` says something on the control channel of the main connection.
    """

    def __init__(self, machine: Machine[Any, Any], say: Callable[[ControlMessage], object], peer_id: str) -> None:
        self.say = say
        self.tasks = BackgroundTasks()
        self._attempt: Attempt | None = None
        self.peer_id = peer_id
        self._driver = MachineDriver(machine, self._carry_out)
        self._is_closed = False

    @abstractmethod
    def begin(self, effect: Any) -> None:
        """Carry out what only this side's machine decides."""

    @abstractmethod
    def dropped(self, attempt: Attempt | None) -> None:
        """The attempt is given up, before or after it had a transport: bulk goes over the main connection."""

    def tell(self, event: object) -> None:
        """What the transport tells, or who wants bulk."""
        self._driver.tell(event)

    def heard(self, message: LaneMessage) -> None:
        """The other side's word about the second connection."""
        if isinstance(message, LaneClose):
            self.tell(BulkCloseHeard(message.attempt, message.code))

    def close(self) -> None:
        """The main connection is over, and this one with it."""
        self._is_closed = True
        self._driver.stop()
        self._drop()

    async def closed(self) -> None:
        """After :meth:`close`: until nothing of it is left."""
        await self.tasks.done()

    def _carry_out(self, effect: Any) -> None:
        match effect:
            case DropBulk():
                self.dropped(self._drop())
            case TellBulkClosed(attempt, code, message):
                fields = {"peerId": self.peer_id, "code": code}
                logger.info("no second connection for bulk data (%s) %s", code, message, extra=fields)
                self.say(LaneClose(attempt=attempt, code=code, message=message[:500] or None))
            case _:
                self.begin(effect)

    def _drop(self) -> Attempt | None:
        attempt, self._attempt = self._attempt, None
        if attempt is not None:
            attempt.is_closed = True
            self.tasks.start(attempt.close())
        return attempt
