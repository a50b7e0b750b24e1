"""Asks a drilled receiver where it is. On a thread of its own and for a limited time: a report that never comes must
hold up neither the robot nor whoever ends the drill."""

from __future__ import annotations

import asyncio
import math
import threading
import time
from collections.abc import Callable, Sequence
from typing import Any, Generic, NoReturn, TypeVar

from mosaic_core.contract.declared.code_lines import standing_at
from mosaic_core.contract.handler import DataChannelReceivable
from mosaic_core.drill.findings import ExerciseFailed
from mosaic_core.runtime.commands.reported_position import ReportedPosition
from mosaic_core.runtime.configuration.receiver_safety import ReceiverSafety
from mosaic_core.runtime.threads.code_places import explained_error
from mosaic_core.runtime.threads.handover import on_loop
from mosaic_core.words.errors import MosaicError

T = TypeVar("T")
ANSWER_S = 2.0
"""A report that takes longer is taken for one that never comes; it should be an attribute that is read."""
KNOWN_S = 1.0
"""For the first report of where it is."""
LOOK_S = 0.02


class PositionReports:
    """What one receiver says of where it is. ``trouble``: why nobody may go by it, so that it must not be moved."""

    def __init__(self, handler: DataChannelReceivable[Any], safety: ReceiverSafety) -> None:
        self._handler = handler
        self._meant = ReportedPosition(handler, safety)
        self.trouble = ""

    async def now(self, fields: Sequence[str]) -> dict[str, float | None]:
        """Where these are; raises :class:`ExerciseFailed` where what it says is of no use."""
        call = _BoundedCall(lambda: {field: self._handler.reported_position(field) for field in fields})
        if not await call.has_returned(ANSWER_S):
            self._fail(f"did not return within {ANSWER_S:g} s{self._place}: it must not block")
        if call.error is not None:
            self._fail(f"raised: {explained_error(call.error)}")
        assert call.result is not None
        return {field: self._number(field, value) for field, value in call.result.items()}

    async def known(self, fields: Sequence[str]) -> dict[str, float]:
        """The same, once all are known; one that stays unknown is of no use either."""
        ends_at_s = time.monotonic() + KNOWN_S
        while True:
            places = await self.now(fields)
            known = {field: place for field, place in places.items() if place is not None}
            if len(known) == len(places):
                return known
            if time.monotonic() >= ends_at_s:
                self._leave_alone(next(field for field in places if field not in known))
            await asyncio.sleep(LOOK_S)

    @property
    def _place(self) -> str:
        return standing_at(type(self._handler).reported_position)

    @property
    def _name(self) -> str:
        return f"{type(self._handler).__name__}.reported_position"

    def _number(self, field: str, value: Any) -> float | None:
        if value is None:
            return None
        try:
            is_finite = math.isfinite(value)
        except TypeError:
            is_finite = False
        if not is_finite:
            self._fail(f"says {value!r} of '{field}'{self._place}: a finite number is wanted, or None if unknown")
        try:
            return self._meant.checked(field, value)
        except MosaicError as wrong:
            self.trouble = wrong.message
            raise ExerciseFailed(wrong.message) from None

    def _fail(self, what: str) -> NoReturn:
        self.trouble = f"{self._name} {what}"
        raise ExerciseFailed(self.trouble)

    def _leave_alone(self, field: str) -> NoReturn:
        self.trouble = (
            f"{self._name} says nothing of '{field}', so a live drill would move it without knowing{self._place}: let "
            "it answer from what was read last, or drill it while its device tells"
        )
        raise ExerciseFailed(self.trouble)


class _BoundedCall(Generic[T]):
    """A call on a thread of its own, which may never come back."""

    def __init__(self, call: Callable[[], T]) -> None:
        self.result: T | None = None
        self.error: BaseException | None = None
        self._call = call
        self._loop = asyncio.get_running_loop()
        self._returned = asyncio.Event()
        threading.Thread(target=self._run, name="mosaic-drill-report", daemon=True).start()

    async def has_returned(self, within_s: float) -> bool:
        try:
            await asyncio.wait_for(self._returned.wait(), within_s)
        except TimeoutError:
            return False
        return True

    def _run(self) -> None:
        try:
            self.result = self._call()
        except BaseException as error:  # noqa: BLE001 (a plugin may raise anything)
            self.error = error
        on_loop(self._loop, self._returned.set)
