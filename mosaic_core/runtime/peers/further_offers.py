"""More media lines on a live peer connection: the operator offers again, over the control channel or the server."""

from __future__ import annotations

import logging
import time
from collections.abc import Awaitable, Callable, Mapping

from mosaic_core.machines.timing.pacing import ComplaintPace, TokenBucket
from mosaic_core.runtime.peers.remote_operator import RemoteOperator
from mosaic_core.words.control import RenegotiateAnswer, RenegotiateOffer
from mosaic_core.words.errors import ConnectionFailed, MosaicError

logger = logging.getLogger(__name__)

MAX_OFFERS_HZ = 0.5
"""One per change of the catalogue; who wants several cameras names them in one."""
MakeAnswer = Callable[[str, Mapping[str, str] | None], Awaitable[str]]
"""``(sdp, tracks)`` → the answer's SDP."""


class FurtherOffers:
    """Answers one operator's offers one at a time: one that comes meanwhile is refused. Event loop only."""

    def __init__(self, operator: RemoteOperator, answer: MakeAnswer) -> None:
        self._operator = operator
        self._answer = answer
        self._rate = TokenBucket.of_rate(MAX_OFFERS_HZ)
        self._complaints = ComplaintPace()
        self._is_busy = False

    async def take(self, offer: RenegotiateOffer) -> None:
        """Answer one of the control channel there, or say there why not; never raises."""
        try:
            answer = RenegotiateAnswer(attempt=offer.attempt, sdp=await self._answered(offer.sdp, offer.tracks))
        except MosaicError as error:
            answer = RenegotiateAnswer(attempt=offer.attempt, code=error.code, message=error.message[:500] or None)
        self._operator.answer(answer)

    async def answered(self, sdp: str, tracks: Mapping[str, str] | None) -> str | None:
        """The answer to one that came through the server, where nobody can be told why there is none; never raises."""
        try:
            return await self._answered(sdp, tracks)
        except MosaicError as error:
            fields = {"peerId": self._operator.peer_id, "code": error.code}
            text = "a further offer of operator %s is refused, its connection goes on: %s (%s)"
            level = logging.WARNING if self._complaints.is_due(error.code, time.monotonic()) else logging.DEBUG
            logger.log(level, text, self._operator.peer_id, error.message, error.code, extra=fields)
            return None

    async def _answered(self, sdp: str, tracks: Mapping[str, str] | None) -> str:
        if self._is_busy or not self._rate.admits(time.monotonic()):
            raise ConnectionFailed("Offers come faster than they are answered.", code="signal.too_slow")
        self._is_busy = True
        try:
            return await self._answer(sdp, tracks)
        except MosaicError:
            raise
        except Exception as error:  # an offer is foreign input: whatever it breaks, the robot goes on
            logger.exception("a further offer of peer %s could not be answered", self._operator.peer_id)
            raise ConnectionFailed(type(error).__name__, code="sdp.invalid") from error
        finally:
            self._is_busy = False
