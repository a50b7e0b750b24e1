"""The peer connection under one operator: answers its offers, tells its candidates after the answer, and closes."""

from __future__ import annotations

import logging
from collections.abc import Mapping

from mosaic_core.machines.peers import peer_of_robot as machine
from mosaic_core.machines.peers.chosen_path import ChosenPath
from mosaic_core.runtime.peers.peer_timeline import PeerTimeline
from mosaic_core.runtime.peers.site import Site
from mosaic_core.runtime.signaling.server_link import Introduction
from mosaic_core.runtime.transport.media_transport import SoundLabels
from mosaic_core.runtime.transport.transport import Answerer, AnswererFactory, AnswererListener, OfferRefused
from mosaic_core.words.errors import ConnectionFailed, MosaicError
from mosaic_core.words.signaling import ExchangeIceCandidate, IceCandidate, SdpAnswer

logger = logging.getLogger(__name__)


class PeerTransport:
    """Answers the offers of one operator and exchanges candidates with it through the server. Event loop only."""

    def __init__(self, introduction: Introduction, site: Site, timeline: PeerTimeline) -> None:
        self._start = introduction.start
        self._server = introduction.server
        self._peer_id = introduction.sender.peer_id
        self._site = site
        self._timeline = timeline
        self._answerer: Answerer | None = None
        self._early: list[IceCandidate] | None = []
        self._is_given_up = False

    def path(self) -> ChosenPath | None:
        """Which way it takes, once it has one."""
        return None if self._answerer is None else self._answerer.path()

    async def answer(
        self, make_answerer: AnswererFactory, listener: AnswererListener
    ) -> machine.AnswerMade | machine.AnswerFailed:
        """Answer the first offer; never raises."""
        start = self._start
        try:
            self._answerer = make_answerer(listener, start.ice_servers)
            sdp = await self.answer_to(start.offer_sdp, start.tracks)
        except MosaicError as error:
            if isinstance(error, OfferRefused) and not self._is_given_up:
                self.tell_answer(error.answer)
            return machine.AnswerFailed(error.code, error.message)
        except Exception as error:  # an offer is foreign input: whatever it breaks, the robot goes on
            logger.exception("the offer of peer %s could not be answered", self._peer_id)
            return machine.AnswerFailed("sdp.invalid", type(error).__name__)
        if self._is_given_up:
            return machine.AnswerMade()
        self.tell_answer(sdp)
        self._timeline.mark("answered")
        if start.candidates or "\na=candidate:" in start.offer_sdp:
            self._timeline.mark("candidate", "with the offer")
        return machine.AnswerMade()

    def tell_answer(self, sdp: str) -> None:
        self._server.signal(SdpAnswer(rtc_connection_id=self._start.peer_id, sdp_answer=sdp))

    async def exchange_candidates(self) -> None:
        """After the answer: an original dashboard rejects candidates before it (UPSTREAM §3.4)."""
        if self._is_given_up or self._answerer is None:
            return
        early, self._early = self._early or [], None
        for candidate in early:
            self.candidate_found(candidate)
        for candidate in self._start.candidates:
            await self._answerer.add_candidate(candidate)

    async def answer_again(self, offer_sdp: str, tracks: Mapping[str, str] | None) -> str:
        """The answer to a further offer; raises :class:`MosaicError`."""
        if self._early is not None:
            raise ConnectionFailed("The first offer is not answered yet.", code="signal.too_slow")
        return await self.answer_to(offer_sdp, tracks)

    async def answer_to(self, offer_sdp: str, tracks: Mapping[str, str] | None) -> str:
        """The answer's SDP, of this offer or a further one; raises :class:`MosaicError`."""
        assert self._answerer is not None
        media, sound = self._site.media, SoundLabels(self._site.media.microphones(), self._site.talk.labels())
        return await self._answerer.answer(offer_sdp, media.cameras(), tracks, sound)

    async def add_candidate(self, candidate: IceCandidate) -> None:
        """One of the operator's; it may have come right behind the offer."""
        if self._answerer is not None:
            await self._answerer.add_candidate(candidate)

    def candidate_found(self, candidate: IceCandidate) -> None:
        """One of ours."""
        if self._early is not None:
            self._early.append(candidate)
        else:
            message = ExchangeIceCandidate(rtc_connection_id=self._start.peer_id, ice_candidate=candidate)
            self._server.signal(message)

    def give_up(self) -> None:
        """Nobody wants an answer any more."""
        self._is_given_up = True

    async def close(self) -> None:
        """Never raises."""
        if self._answerer is None:
            return
        try:
            await self._answerer.close()
        except Exception:  # it is over either way, but whoever looks for a leak must find it
            logger.warning("the transport of peer %s did not close cleanly", self._peer_id, exc_info=True)
