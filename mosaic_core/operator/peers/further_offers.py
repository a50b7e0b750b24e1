"""Lines for pictures that became known after the first offer: offered over the control channel of the live connection.

One offer at a time; a robot that refuses one, or says nothing, is not asked again on this connection.
"""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Callable, Mapping

from mosaic_core.runtime.timing.background_tasks import BackgroundTasks
from mosaic_core.runtime.timing.deadline_timer import DeadlineTimer
from mosaic_core.runtime.transport.operator_transport import Offerer
from mosaic_core.words.control import ControlMessage, RenegotiateAnswer, RenegotiateOffer
from mosaic_core.words.errors import MosaicError

_log = logging.getLogger(__name__)

ANSWER_TIMEOUT_S = 10.0


class FurtherOffers:
    """Asks the robot for more media lines, all that are wanted at a time. Event loop only.

    ``settled()``: the lines that were asked for are there, or will never be.
    """

    def __init__(self, offerer: Offerer, say: Callable[[ControlMessage], bool], settled: Callable[[], None]) -> None:
        self._offerer = offerer
        self._say = say
        self._settled = settled
        self._is_known = False
        self._attempt = 0
        self._wanted: list[str] = []
        self._offered: set[str] = set()
        self._patience = DeadlineTimer(self._timed_out)
        self._tasks = BackgroundTasks()
        self._is_busy = False
        self._is_asked = False

    def greeted(self, extensions: Mapping[str, int]) -> None:
        """The robot's hello says whether it takes further offers."""
        self._is_known = "renegotiate" in extensions

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

    def answered(self, answer: RenegotiateAnswer) -> None:
        if not self._is_asked or answer.attempt != self._attempt:
            return
        self._stop_asking()
        if answer.sdp is None:
            self._give_up(answer.code)
        else:
            self._tasks.start(self._accept(answer.sdp))

    def close(self) -> None:
        self._is_known = False
        self._stop_asking()
        self._tasks.cancel()

    def _next(self) -> None:
        if self._wanted and not self._is_busy:
            self._is_busy = True
            self._tasks.start(self._offer())

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
        self._is_asked = True
        self._patience.set(time.monotonic() + ANSWER_TIMEOUT_S)
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
        self._stop_asking()
        self._is_known = self._is_busy = False
        self._wanted.clear()
        self._settled()

    def _timed_out(self) -> None:
        self._give_up("signal.timeout")

    def _stop_asking(self) -> None:
        self._is_asked = False
        self._patience.cancel()
