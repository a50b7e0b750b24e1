"""Lines for pictures that became known after the first offer: offered over the control channel of the live connection.

One offer at a time; a robot that refuses one, or says nothing, is not asked again on this connection.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Coroutine
from typing import Any

from mosaic_core.runtime.transport.operator_transport import Offerer
from mosaic_core.words.control import ControlMessage, RenegotiateAnswer, RenegotiateOffer
from mosaic_core.words.errors import MosaicError

_log = logging.getLogger(__name__)

ANSWER_TIMEOUT_S = 10.0


class FurtherOffers:
    """Of one connection; event loop only. ``settled``: the lines that were asked for are there, or will never be."""

    def __init__(self, offerer: Offerer, say: Callable[[ControlMessage], bool], settled: Callable[[], None]) -> None:
        self._offerer = offerer
        self._say = say
        self._settled = settled
        self._is_known = False
        self._attempt = 0
        self._wanted: list[str] = []
        self._offered: set[str] = set()
        self._timer: asyncio.TimerHandle | None = None
        self._tasks: set[asyncio.Task[None]] = set()
        self._is_busy = False

    def greeted(self, *, is_known: bool) -> None:
        """The robot's hello says whether it takes further offers."""
        self._is_known = is_known

    def want(self, label: str) -> bool:
        """Whether a line for this picture is on its way; ``False``: there will be none."""
        if not self._is_known:
            return False
        if label in self._offered:
            return self._is_busy
        if label not in self._wanted:
            self._wanted.append(label)
            self._next()
        return True

    def hear(self, answer: RenegotiateAnswer) -> None:
        """The robot's answer."""
        if not self._is_busy or self._timer is None or answer.attempt != self._attempt:
            return
        self._disarm()
        if answer.sdp is None:
            self._give_up(answer.code)
        else:
            self._run(self._accept(answer.sdp))

    def close(self) -> None:
        """The connection is over."""
        self._is_known = False
        self._disarm()
        for task in self._tasks:
            task.cancel()

    def _next(self) -> None:
        if self._wanted and not self._is_busy:
            self._is_busy = True
            self._run(self._offer())

    async def _offer(self) -> None:
        await asyncio.sleep(0)  # who opens several stores in a row needs one offer
        labels, self._wanted = self._wanted, []
        self._offered.update(labels)
        self._attempt += 1
        try:
            sdp, tracks = await self._offerer.offer_more(labels)
        except MosaicError as error:
            self._give_up(error.code)
            return
        self._timer = asyncio.get_running_loop().call_later(ANSWER_TIMEOUT_S, self._give_up, "signal.timeout")
        self._say(RenegotiateOffer(attempt=self._attempt, sdp=sdp, tracks=dict(tracks)))

    async def _accept(self, sdp: str) -> None:
        try:
            await self._offerer.accept_answer(sdp)
        except MosaicError as error:
            self._give_up(error.code)
            return
        self._is_busy = False
        self._settled()
        self._next()

    def _give_up(self, code: str) -> None:
        _log.info("the connection keeps the media lines that it has (%s)", code)
        self._disarm()
        self._is_known = self._is_busy = False
        self._wanted.clear()
        self._settled()

    def _disarm(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _run(self, work: Coroutine[Any, Any, None]) -> None:
        task = asyncio.create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
