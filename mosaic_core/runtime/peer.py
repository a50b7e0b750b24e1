"""One operator's peer connection on the robot: carries out its session machine and routes its channels and tracks."""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Callable, Coroutine, Mapping, Sequence
from typing import Any

from mosaic_core.contract.host import Outgoing, Sender
from mosaic_core.machines import peer_session as session
from mosaic_core.machines.chosen_path import ChosenPath
from mosaic_core.machines.command_gate import ArrivalBaseline
from mosaic_core.machines.peer_admission import StartPeer
from mosaic_core.machines.send_scheduler import Offered
from mosaic_core.runtime.bulk_lane import BulkLane, LaneOwner
from mosaic_core.runtime.control_link import ControlLink
from mosaic_core.runtime.further_offers import FurtherOffers
from mosaic_core.runtime.peer_channels import PeerChannels
from mosaic_core.runtime.peer_control import PeerControl
from mosaic_core.runtime.peer_resume import PeerResume
from mosaic_core.runtime.peer_timeline import PeerTimeline
from mosaic_core.runtime.plain_stream import NewestFeed
from mosaic_core.runtime.send_queue import SendQueue
from mosaic_core.runtime.site import Site
from mosaic_core.runtime.sound_transport import IncomingSound, SoundLabels
from mosaic_core.runtime.stop_link import StopLink
from mosaic_core.runtime.transport import Answerer, AnswererFactory, Channel, PictureFeed
from mosaic_core.words import control
from mosaic_core.words.control import CHANNEL_PROTOCOL, CONTROL_LABEL, PING_PERIOD_S, STOP_LABEL
from mosaic_core.words.errors import MosaicError
from mosaic_core.words.signaling import ExchangeIceCandidate, IceCandidate, SdpAnswer

logger = logging.getLogger(__name__)

DOUBT_S = 2 * PING_PERIOD_S + 0.2
"""Two pings and the way here."""
_BYE_FLUSH_S = 0.05
"""Time for the bye to leave before the transport closes."""


class OperatorPeer:
    """Implements ``AnswererListener``; event loop only."""

    def __init__(self, start: StartPeer, site: Site, make_answerer: AnswererFactory) -> None:
        self._control = PeerControl(start.peer_id, start.identity, site)
        self.connected_at_s: float | None = None
        self._start = start
        self._site = site
        self._loop = asyncio.get_running_loop()
        self._session = session.PeerSession(time.monotonic(), expects_channels="\nm=application " in start.offer_sdp)
        self._baseline = ArrivalBaseline()
        self._queue = SendQueue(self._has_room, site.outbox.left_out)
        self._resume = PeerResume(lambda: self.sender, site, self._control.answer)
        self._channels = PeerChannels(lambda: self.sender, site, self._queue, self._baseline, self.refuse, self._resume)
        self._lane = BulkLane(self._lane_owner(make_answerer))
        self._offers = FurtherOffers(start.peer_id, self._answer_to, self._control.answer)
        self._unbound: list[str] = []
        self._origins: list[control.MediaOrigin] = []
        self._early: list[IceCandidate] | None = []
        self._timer: asyncio.TimerHandle | None = None
        self._tasks: set[asyncio.Task[None]] = set()
        self._make_answerer = make_answerer
        self._answerer: Answerer | None = None
        self._closed = asyncio.Event()
        self.timeline = PeerTimeline(start.peer_id, self._path, lambda: self.sender.name)

    @property
    def sender(self) -> Sender:
        """Who it is, as far as it has said."""
        return self._control.sender

    @property
    def peer_id(self) -> str:
        return self._start.peer_id

    @property
    def phase(self) -> str:
        return self._session.phase

    @property
    def channels(self) -> tuple[str, ...]:
        """Labels of the open data channels."""
        return self._channels.labels()

    def _has_room(self, label: str) -> None:
        self._site.outbox.has_room(label, self.peer_id)
        self._resume.has_room(label)

    def _lane_owner(self, make_answerer: AnswererFactory) -> LaneOwner:
        return LaneOwner(
            self.peer_id,
            make_answerer,
            lambda: self._site.listener.newest_ice_servers() or self._start.ice_servers,
            self._control.answer,
            self._channels.opened_for_bulk,
            self._channels.drop,
            self._has_room,
            self._site.outbox.left_out,
        )

    # -- life ----------------------------------------------------------------------------------------------------

    def begin(self) -> None:
        """Answer the offer."""
        self._rearm()
        self._spawn(self._answer())

    def _path(self) -> ChosenPath | None:
        return None if self._answerer is None else self._answerer.path()

    def add_candidate(self, candidate: IceCandidate) -> None:
        self.timeline.mark("candidate")
        if self._answerer is not None and self.phase != "closed":
            self._spawn(self._answerer.add_candidate(candidate))

    def close(self, code: str, message: str = "") -> None:
        """Begin to close; an operator of ours hears why."""
        self._handle(session.CloseRequested(code, message))

    def doubt(self) -> None:
        """The robot's network is another one: operators of ours ping, so a live one is heard soon."""
        self._handle(session.Doubted(DOUBT_S))

    async def closed(self) -> None:
        await self._closed.wait()

    def deliver(self, message: Outgoing) -> Offered:
        return self._channels.deliver(message)

    def refuse(self, label: str, seq: int | None, code: str, message: str = "") -> None:
        """Tell an operator of ours that a message was refused."""
        if self._control.link is not None:
            self._control.link.refuse(label, seq, code, message)

    async def _answer_to(self, offer_sdp: str, tracks: Mapping[str, str] | None) -> str:
        assert self._answerer is not None
        media, sound = self._site.media, SoundLabels(self._site.media.microphones(), self._site.talk.labels())
        return await self._answerer.answer(offer_sdp, media.cameras(), tracks, sound)

    async def _answer(self) -> None:
        start = self._start
        try:
            self._answerer = answerer = self._make_answerer(self, start.ice_servers)
            sdp = await self._answer_to(start.offer_sdp, start.tracks)
        except MosaicError as error:
            self._handle(session.AnswerFailed(error.code, error.message))
            return
        except Exception as error:  # an offer is foreign input: whatever it breaks, the robot goes on
            logger.exception("the offer of peer %s could not be answered", self.peer_id)
            self._handle(session.AnswerFailed("sdp.invalid", type(error).__name__))
            return
        if self.phase == "closed":
            return
        self._site.listener.signal(SdpAnswer(rtc_connection_id=self.peer_id, sdp_answer=sdp))
        self.timeline.mark("answered")
        if start.candidates or "\na=candidate:" in start.offer_sdp:
            self.timeline.mark("candidate", "with the offer")
        self._handle(session.Answered())
        early, self._early = self._early or [], None
        for candidate in early:  # an original dashboard rejects candidates before the answer (UPSTREAM §3.4)
            self.candidate_found(candidate)
        for candidate in start.candidates:
            await answerer.add_candidate(candidate)

    def _handle(self, event: session.Event) -> None:
        for effect in self._session.handle(event, time.monotonic()):
            match effect:
                case session.TellConnected():
                    self.connected_at_s = time.monotonic()
                    self._site.listener.peer_connected(self)
                case session.TreatAsOurs():
                    self._treat_as_ours()
                case session.TreatAsOriginal():
                    self._treat_as_original()
                    for label in self._site.media.labels():
                        if self._site.media.is_bound(self.peer_id, label):
                            self._site.media.watch(self.peer_id, label, True)
                case session.Close(code, message, say_bye):
                    self._end(code, message, say_bye)
        self._rearm()

    def _rearm(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        if self._session.deadline_s is not None:
            delay_s = max(0.0, self._session.deadline_s - time.monotonic())
            self._timer = self._loop.call_later(delay_s, self._handle, session.DeadlinePassed())

    def _treat_as_ours(self) -> None:
        assert self._control.link is not None
        for label in self._site.media.watched_by(self.peer_id):  # a late hello: it will say what it wants to see
            self._site.media.watch(self.peer_id, label, False)
        self._control.link.send(control.CatalogueFull(catalogue=self._site.catalogue))
        self.timeline.mark("catalogue")
        for origin in self._origins:
            self._control.link.send(origin)
        for label in self._unbound:
            self._control.link.send(control.MediaUnavailable(label=label, code="media.no_line"))
        for label, who in self._site.talk.talking().items():
            self.talking_changed(label, who)
        self._control.joined()

    def _treat_as_original(self) -> None:
        self._resume.plain()
        if not self._control.treat_as_original():
            self._loop.call_soon(self.close, "peer.not_allowed")

    def talking_changed(self, label: str, who: Sender | None) -> None:
        """Somebody talks to the loudspeaker ``label``, or nobody does any more."""
        known = {} if who is None else {"peer_id": who.peer_id, "name": who.name}
        self._control.tell(control.MediaTalking(label=label, **known))

    def _end(self, code: str, message: str, say_bye: bool) -> None:
        if say_bye and self._control.link is not None:
            self._control.link.send(control.Bye(code=code, message=message or None))
        self._site.media.leave(self.peer_id)
        self._site.talk.leave(self.peer_id)
        self._lane.close()
        self._channels.close_all()
        self._resume.left(code)
        self._control.left(code)
        self.timeline.ended(code, was_connected=self.connected_at_s is not None)
        self._site.listener.peer_closed(self, code, message)
        self._spawn(self._close_transport(_BYE_FLUSH_S if say_bye else 0.0))

    async def _close_transport(self, flush_s: float) -> None:
        await asyncio.sleep(flush_s)
        self._queue.close_all()
        if self._answerer is not None:
            try:
                await self._answerer.close()
            except Exception:  # it is over either way, but whoever looks for a leak must find it
                logger.warning("the transport of peer %s did not close cleanly", self.peer_id, exc_info=True)
        await self._lane.closed()
        self._closed.set()

    def _spawn(self, work: Coroutine[Any, Any, None]) -> None:
        task = self._loop.create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    # -- what the transport tells --------------------------------------------------------------------------------

    def candidate_found(self, candidate: IceCandidate) -> None:
        if self._early is not None:
            self._early.append(candidate)
        else:
            message = ExchangeIceCandidate(rtc_connection_id=self.peer_id, ice_candidate=candidate)
            self._site.listener.signal(message)

    def state_changed(self, state: str) -> None:
        self.timeline.transport_changed(state)
        self._handle(session.TransportChanged(state))

    def channel_opened(self, channel: Channel) -> None:
        if self.phase == "closed":
            return
        self._handle(session.ChannelOpened())
        if channel.label == CONTROL_LABEL:
            if self._control.link is None and channel.protocol == CHANNEL_PROTOCOL:
                self.timeline.mark("control")
                self._control.link = ControlLink(channel, self._queue, self._baseline, self._heard)
                self._control.link.greet(self._site.software, self._site.boot_id)
        elif channel.label == STOP_LABEL and channel.protocol == CHANNEL_PROTOCOL:
            self._control.stop_link = StopLink(channel, self._heard_on_stop_channel)
        else:
            if channel.protocol != CHANNEL_PROTOCOL and not self.sender.is_original and self.phase != "open":
                self._treat_as_original()  # ours frame everything: no need to wait for a hello that will not come
            self._channels.opened(channel)

    def track_bound(self, label: str) -> PictureFeed:
        if self.phase == "closed":  # it ended while its offer was being answered: nobody would unbind this one
            return NewestFeed()

        def unavailable(code: str) -> None:
            if self._control.link is not None:
                self._control.link.send(control.MediaUnavailable(label=label, code=code))

        return self._site.media.bind(self.peer_id, label, unavailable)

    def voice_bound(self, label: str, sound: IncomingSound) -> None:
        if self.phase == "closed":
            sound.stop()
        else:
            self._site.talk.bind(self, label, sound)

    def tracks_unbound(self, labels: Sequence[str]) -> None:
        self._unbound = list(labels)

    def origin_known(self, label: str, ssrc: int, rtp_origin: int) -> None:
        origin = control.MediaOrigin(label=label, ssrc=ssrc, rtp_origin=rtp_origin, boot_id=self._site.boot_id)
        self.timeline.frame_sent(label)
        self._origins = [known for known in self._origins if known.label != label] + [origin]
        if self._control.link is not None and self.phase == "open":
            self._control.link.send(origin)

    def _heard(self, message: control.ControlMessage | None) -> None:
        match message:
            case control.Hello():
                self.timeline.mark("hello")
                if self.phase not in ("open", "closed"):
                    self._control.greeted(message)
                    self._resume.greeted(message)
                self._handle(session.HelloReceived())
            case control.Bye():
                self._handle(session.ByeReceived(message.code, message.message or ""))
            case control.MediaWatch():
                self._handle(session.ControlReceived())
                self._watch(message.label, message.on)
            case control.LaneOffer() | control.LaneCandidate() | control.LaneClose():
                self._handle(session.ControlReceived())
                if self.phase == "open":
                    self._lane.heard(message)
            case control.RenegotiateOffer():
                self._handle(session.ControlReceived())
                if self.phase == "open":
                    self._spawn(self._offers.take(message))
            case control.Resume() | control.Delivered():
                self._handle(session.ControlReceived())
                if self.phase == "open":
                    self._resume.heard(message)
            case None:
                self._handle(session.ControlReceived())
            case _:
                self._handle(session.ControlReceived())
                self._control.heard(message)

    def _heard_on_stop_channel(
        self, message: control.Stop | control.Pong, answer: Callable[[control.ControlMessage], None]
    ) -> None:
        if self.phase == "closed":
            return
        if isinstance(message, control.Stop):
            self._control.stop(message, answer)
        else:
            self._control.heard(message)

    def _watch(self, label: str, on: bool) -> None:
        media = self._site.media
        if on and not media.is_bound(self.peer_id, label) and self._control.link is not None:
            code = "media.no_line" if label in media.labels() else "channel.unknown_label"
            self._control.link.send(control.MediaUnavailable(label=label, code=code))
        elif label in media.labels() and self.phase != "closed":
            media.watch(self.peer_id, label, on)
            self.timeline.watched(label, on and label in media.cameras())
            if not on:
                self._control.unwatched(label)
