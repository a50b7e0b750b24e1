"""More media lines on a live peer connection: the operator offers again, over the control channel."""

from __future__ import annotations

import logging
import time
from collections.abc import Awaitable, Callable, Mapping

from mosaic_core.machines.rate_gate import RateGate
from mosaic_core.words.control import ControlMessage, RenegotiateAnswer, RenegotiateOffer
from mosaic_core.words.errors import MosaicError

logger = logging.getLogger(__name__)

MAX_OFFERS_HZ = 0.5
"""One per change of the catalogue; who wants several cameras names them in one."""
Answer = Callable[[str, Mapping[str, str]], Awaitable[str]]
"""``(sdp, tracks)`` → the answer's SDP."""


class FurtherOffers:
    """Of one peer; event loop only. One at a time: an offer that comes meanwhile is refused."""

    def __init__(self, peer_id: str, answer: Answer, tell: Callable[[ControlMessage], None]) -> None:
        self._peer_id = peer_id
        self._answer = answer
        self._tell = tell
        self._rate = RateGate(MAX_OFFERS_HZ)
        self._is_busy = False

    async def take(self, offer: RenegotiateOffer) -> None:
        """Answer it, or say why not; never raises."""
        if self._is_busy or not self._rate.admits(time.monotonic()):
            self._tell(RenegotiateAnswer(attempt=offer.attempt, code="signal.too_slow"))
            return
        self._is_busy = True
        try:
            self._tell(await self._answered(offer))
        finally:
            self._is_busy = False

    async def _answered(self, offer: RenegotiateOffer) -> RenegotiateAnswer:
        try:
            sdp = await self._answer(offer.sdp, offer.tracks)
        except MosaicError as error:
            return RenegotiateAnswer(attempt=offer.attempt, code=error.code, message=error.message[:500])
        except Exception as error:  # an offer is foreign input: whatever it breaks, the robot goes on
            logger.exception("a further offer of peer %s could not be answered", self._peer_id)
            return RenegotiateAnswer(attempt=offer.attempt, code="sdp.invalid", message=type(error).__name__)
        return RenegotiateAnswer(attempt=offer.attempt, sdp=sdp)
