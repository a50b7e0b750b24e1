"""A lease in a program's hands: held until given back, or lost, and losing it is an event that nobody can miss."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from types import TracebackType
from typing import Self

from mosaic_core.operator.delivery.listeners import Listeners
from mosaic_core.words.codes import REASONS, reason
from mosaic_core.words.errors import MosaicError


class LeaseDenied(MosaicError):
    """The robot did not grant what was asked for; ``code`` says why: ``lease.person_commands``, ``lease.queued``…"""

    def __init__(self, resource: str, code: str, message: str = "", *, cure: str | None = None) -> None:
        known = code if code in REASONS else "lease.denied"
        super().__init__(message or reason(known).sentence, code=known, cure=cure)
        self.resource = resource


class LeaseLost(MosaicError):
    """A lease ended though its holder did not give it back (``lease.taken_over``, ``lease.expired``, …)."""

    def __init__(self, resource: str, code: str, message: str = "") -> None:
        known = code if code in REASONS else "lease.not_holder"
        super().__init__(message or reason(known).sentence, code=known)
        self.resource = resource


class Lease:
    """A lease that this program holds, made by ``connection.control.take()``; the connection keeps it alive. Event loop
    only.

    As ``async with`` it is given back at the end, and losing it cancels the block and raises :class:`LeaseLost` there,
    so that no program drives on without noticing. Used without, look at :attr:`lost` or listen with :meth:`on_lost`.
    """

    def __init__(self, resource: str, epoch: int, give_back: Callable[[Lease], None]) -> None:
        self.resource = resource
        self.epoch = epoch
        """The number of this grant; every command carries it."""
        self.lost: LeaseLost | None = None
        self._give_back = give_back
        self._is_released = False
        self._listeners: Listeners[[LeaseLost]] = Listeners()
        self._ended = asyncio.Event()
        self._block: asyncio.Task[object] | None = None
        self._cancellations = 0
        self._has_cancelled = False

    @property
    def is_held(self) -> bool:
        """Whether commands under it count: neither lost nor given back."""
        return self.lost is None and not self._is_released

    def on_lost(self, callback: Callable[[LeaseLost], None]) -> Callable[[], None]:
        """Call ``callback(lost)`` once when the lease is lost; returns what ends it."""
        return self._listeners.add(callback)

    async def wait_lost(self) -> LeaseLost | None:
        """Until it is lost, with the reason, or given back (``None``)."""
        await self._ended.wait()
        return self.lost

    def release(self) -> None:
        """Give it back; doing so twice, or after it was lost, does nothing."""
        if self.is_held:
            self._is_released = True
            self._ended.set()
            self._give_back(self)

    async def __aenter__(self) -> Self:
        if self.lost is not None:
            raise self.lost
        self._block = asyncio.current_task()
        self._cancellations = self._block.cancelling() if self._block is not None else 0
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        block, self._block = self._block, None
        self.release()
        if self.lost is None:
            return
        is_ours = self._has_cancelled and block is not None and block.uncancel() <= self._cancellations
        if error is None or (is_ours and isinstance(error, asyncio.CancelledError)):
            raise self.lost from None

    # -- called by the connection ----------------------------------------------------------------------------------

    def end(self, lost: LeaseLost) -> None:
        """Called by the desk: the lease is lost; the block under it is cancelled."""
        if not self.is_held:
            return
        self.lost = lost
        self._ended.set()
        # Not at once: the block itself may be running right now, and would only meet it after its own end.
        asyncio.get_running_loop().call_soon(self._cancel_block)
        self._listeners.tell(lost)

    def _cancel_block(self) -> None:
        if self._block is not None:
            self._has_cancelled = True
            self._block.cancel()

    @property
    def is_in_a_block(self) -> bool:
        """Used as ``async with``: its loss ends the block, and nobody would use what is regained."""
        return self._block is not None

    def regained(self, epoch: int) -> None:
        """The connection has come back and the robot has granted it anew."""
        self.epoch, self.lost = epoch, None
        self._ended.clear()

    def end_released(self) -> None:
        """Somebody else in this program gave the resource back."""
        if self.is_held:
            self._is_released = True
            self._ended.set()
