"""Remembers who in this program asked for a lease, and who holds one: brings the robot's answers to the right place."""

from __future__ import annotations

import asyncio
from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from mosaic_core.machines.control.operator_control import Denied, Granted, Lost, Queued
from mosaic_core.operator.control.lease import Lease, LeaseDenied, LeaseLost
from mosaic_core.words.errors import ConnectionFailed, MosaicError

ANSWER_S = 5.0
"""A robot that is connected answers within a round trip; one that does not in this time knows no leases."""


@dataclass(slots=True, eq=False)
class _Taker:
    answers: asyncio.Queue[Lease | Queued | Denied] = field(default_factory=asyncio.Queue)


class LeaseTakers:
    """Hands the robot's decisions to the takers and holders of leases in this program. Event loop only.

    ``give_up(resource)`` tells the robot that nobody here wants it any more.
    """

    def __init__(self, give_up: Callable[[str], None]) -> None:
        self._give_up = give_up
        self._takers: defaultdict[str, list[_Taker]] = defaultdict(list)
        self._live: defaultdict[str, list[Lease]] = defaultdict(list)

    async def take(self, resource: str, ask: Callable[[], None], wait_s: float) -> Lease:
        """Call ``ask`` and wait for the answer; what nobody waits for any more is given up."""
        taker = _Taker()
        self._takers[resource].append(taker)
        try:
            ask()
            return await _granted(taker, resource, wait_s)
        finally:
            self._takers[resource].remove(taker)
            self._unclaimed(taker, resource)

    def decided(self, effect: Granted | Queued | Denied | Lost) -> None:
        match effect:
            case Granted(resource, epoch):
                for taker in self._takers[resource]:
                    lease = Lease(resource, epoch, self._given_back)
                    self._live[resource].append(lease)
                    taker.answers.put_nowait(lease)
            case Lost(resource, code, message):
                for lease in self._live.pop(resource, []):
                    lease.end(LeaseLost(resource, code, message))
            case Queued() | Denied():
                for taker in self._takers[effect.resource]:
                    taker.answers.put_nowait(effect)

    def held_for_long(self) -> list[Lease]:
        """What is held outside of any block, and so by a program that will look at it again."""
        return [lease for leases in self._live.values() for lease in leases if not lease.is_in_a_block]

    def regained(self, leases: Sequence[Lease], again: Lease) -> None:
        """Hold lost ones again, in place of the one that was taken for them."""
        live = self._live[again.resource]
        if again in live:
            live.remove(again)
            for lease in leases:
                lease.regained(again.epoch)
                live.append(lease)

    def release(self, resource: str) -> None:
        for lease in self._live.pop(resource, []):
            lease.end_released()
        self._give_up(resource)

    def _given_back(self, lease: Lease) -> None:
        if lease in self._live[lease.resource]:
            self.release(lease.resource)

    def _unclaimed(self, taker: _Taker, resource: str) -> None:
        """The taker has left: with its lease, or without, and then an answer may still have come for it."""
        while not taker.answers.empty():
            left = taker.answers.get_nowait()
            if isinstance(left, Lease) and left in self._live[resource]:
                self._live[resource].remove(left)
        if not self._takers[resource] and not self._live[resource]:
            self._give_up(resource)


async def _granted(taker: _Taker, resource: str, wait_s: float) -> Lease:
    loop = asyncio.get_running_loop()
    patience_s, ends_at_s = ANSWER_S, loop.time() + wait_s
    too_late: MosaicError = ConnectionFailed("The robot does not answer the request.", code="channel.timeout")
    while True:
        try:
            async with asyncio.timeout(patience_s):
                answer = await taker.answers.get()
        except TimeoutError:
            raise too_late from None
        match answer:
            case Lease():
                return answer
            case Denied(code=code, message=message):
                raise LeaseDenied(resource, code, message)
            case Queued(message=message):
                too_late = LeaseDenied(resource, "lease.queued", message)
                patience_s = ends_at_s - loop.time()
