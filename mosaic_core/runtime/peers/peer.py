"""One operator on the robot: carries out its session machine, and routes what its transport and it itself say."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Coroutine, Mapping, Sequence
from typing import Any

from mosaic_core.contract.host import Outgoing, Sender
from mosaic_core.machines.commands.command_gate import ArrivalBaseline
from mosaic_core.machines.delivery.send_scheduler import Offered
from mosaic_core.machines.peers import peer_of_robot as session
from mosaic_core.machines.signaling.peer_admission import StartPeer
from mosaic_core.runtime.delivery.send_queue import SendQueue
from mosaic_core.runtime.peers.bulk_of_robot import BulkOfRobot
from mosaic_core.runtime.peers.control_channel import ControlChannel
from mosaic_core.runtime.peers.further_offers import FurtherOffers
from mosaic_core.runtime.peers.peer_channels import PeerChannels
from mosaic_core.runtime.peers.peer_control import PeerControl
from mosaic_core.runtime.peers.peer_media import PeerMedia
from mosaic_core.runtime.peers.peer_resume import PeerResume
from mosaic_core.runtime.peers.peer_timeline import PeerTimeline
from mosaic_core.runtime.peers.peer_transport import PeerTransport
from mosaic_core.runtime.peers.site import Site
from mosaic_core.runtime.peers.stop_channel import StopChannel
from mosaic_core.runtime.transport.picture_transport import PictureFeed
from mosaic_core.runtime.transport.sound_transport import IncomingSound
from mosaic_core.runtime.transport.transport import AnswererFactory, Channel
from mosaic_core.words import control
from mosaic_core.words.control import CHANNEL_PROTOCOL, CONTROL_LABEL, PING_PERIOD_S, STOP_LABEL
from mosaic_core.words.ice import IceServer
from mosaic_core.words.session_description import is_media_only
from mosaic_core.words.signaling import IceCandidate, SdpAnswer

DOUBT_S = 2 * PING_PERIOD_S + 0.2
"""Two pings and the way here."""
_BYE_FLUSH_S = 0.05
"""Time for the bye to leave before the transport closes."""


class Peer:
    """Implements ``AnswererListener``; event loop only."""

    def __init__(self, start: StartPeer, site: Site, make_answerer: AnswererFactory) -> None:
        self._control = PeerControl(start.peer_id, start.identity, site)
        self.connected_at_s: float | None = None
        self._start = start
        self._site = site
        self._loop = asyncio.get_running_loop()
        self._session = session.RobotPeerMachine(time.monotonic(), is_media_only=is_media_only(start.offer_sdp))
        self._baseline = ArrivalBaseline()
        self._queue = self.new_queue()
        self._resume = PeerResume(lambda: self.sender, site, self._control.answer)
        self._channels = PeerChannels(lambda: self.sender, site, self._queue, self._baseline, self.refuse, self._resume)
        self._bulk = BulkOfRobot(self, self._channels, make_answerer)
        self.timeline = PeerTimeline(start.peer_id, lambda: self._transport.path(), lambda: self.sender.name)
        self.media = PeerMedia(self, site, self._control, self.timeline)
        self._transport = self._made_transport(make_answerer)
        self._offers = FurtherOffers(start.peer_id, self._transport.answer_again, self._control.answer)
        self._timer: asyncio.TimerHandle | None = None
        self._tasks: set[asyncio.Task[None]] = set()
        self._closed = asyncio.Event()

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

    # -- what the second connection needs ------------------------------------------------------------------------

    def say(self, message: control.ControlMessage) -> None:
        """Tell the operator, over the control channel."""
        self._control.answer(message)

    def new_queue(self) -> SendQueue:
        """A queue for one peer connection of this operator."""
        return SendQueue(self._has_room, self._site.outbox.left_out)

    def newest_ice_servers(self) -> Sequence[IceServer]:
        return self._site.listener.newest_ice_servers() or self._start.ice_servers

    def _made_transport(self, make_answerer: AnswererFactory) -> PeerTransport:
        start = self._start
        return PeerTransport(
            start,
            self._site,
            self.timeline,
            lambda: make_answerer(self, start.ice_servers),
            self._handle,
            lambda: self.phase == "closed",
        )

    # -- life ----------------------------------------------------------------------------------------------------

    def begin(self) -> None:
        """Answer the offer."""
        self._rearm()
        self._spawn(self._transport.answer())

    def add_candidate(self, candidate: IceCandidate) -> None:
        self.timeline.mark("candidate")
        if self.phase != "closed":
            self._spawn(self._transport.add_candidate(candidate))

    def renegotiate(self, offer_sdp: str, tracks: Mapping[str, str] | None) -> None:
        """Answer a further offer that came through the server; a refused one leaves the connection as it is."""
        self._spawn(self._renegotiated(offer_sdp, tracks))

    async def _renegotiated(self, offer_sdp: str, tracks: Mapping[str, str] | None) -> None:
        sdp = await self._offers.answered(offer_sdp, tracks)
        if sdp is None or self.phase == "closed":
            return
        self._site.listener.signal(SdpAnswer(rtc_connection_id=self.peer_id, sdp_answer=sdp))
        if self.phase == "original":
            self.media.show_all()

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
                    self.media.show_all()
                case session.ClosePeer(code, message, say_bye):
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
        self.media.show_nothing()
        self._control.link.send(control.CatalogueFull(catalogue=self._site.catalogue))
        self.timeline.mark("catalogue")
        self.media.greeted()
        self._control.joined()

    def _treat_as_original(self) -> None:
        self._resume.plain()
        if not self._control.treat_as_original():
            self._loop.call_soon(self.close, "peer.not_allowed")

    def _end(self, code: str, message: str, say_bye: bool) -> None:
        if say_bye and self._control.link is not None:
            self._control.link.send(control.Bye(code=code, message=message or None))
        self.media.left()
        self._bulk.close()
        self._channels.close_all()
        self._resume.left(code)
        self._control.left(code)
        self.timeline.ended(code, was_connected=self.connected_at_s is not None)
        self._site.listener.peer_closed(self, code, message)
        self._spawn(self._close_transport(_BYE_FLUSH_S if say_bye else 0.0))

    async def _close_transport(self, flush_s: float) -> None:
        await asyncio.sleep(flush_s)
        self._queue.close_all()
        await self._transport.close()
        await self._bulk.closed()
        self._closed.set()

    def _spawn(self, work: Coroutine[Any, Any, None]) -> None:
        task = self._loop.create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    # -- what the transport tells --------------------------------------------------------------------------------

    def candidate_found(self, candidate: IceCandidate) -> None:
        self._transport.candidate_found(candidate)

    def state_changed(self, state: str) -> None:
        self.timeline.transport_changed(state)
        self._handle(session.TransportChanged(state))

    def channel_opened(self, channel: Channel) -> None:
        if self.phase == "closed":
            return
        self._handle(session.ChannelOpened(_maker(channel)))
        if channel.label == CONTROL_LABEL:
            if self._control.link is None and channel.protocol == CHANNEL_PROTOCOL:
                self.timeline.mark("control")
                self._control.link = ControlChannel(channel, self._queue, self._baseline, self._heard)
                self._control.link.greet(self._site.software, self._site.boot_id)
        elif channel.label == STOP_LABEL and channel.protocol == CHANNEL_PROTOCOL:
            self._control.stop_link = StopChannel(channel, self._heard_on_stop_channel)
        else:
            self._channels.opened(channel)

    def track_bound(self, label: str) -> PictureFeed:
        return self.media.bound(label)

    def voice_bound(self, label: str, sound: IncomingSound) -> None:
        self.media.voice_bound(label, sound)

    def tracks_unbound(self, labels: Sequence[str]) -> None:
        self.media.unbound(labels)

    def track_refused(self, label: str, cause: str) -> None:
        self.media.refused(label, cause)

    def origin_known(self, label: str, ssrc: int, rtp_origin: int) -> None:
        self.media.origin_known(label, ssrc, rtp_origin)

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
                self.media.watch(message.label, message.on)
            case control.LaneOffer() | control.LaneCandidate() | control.LaneClose():
                self._handle(session.ControlReceived())
                if self.phase == "open":
                    self._bulk.heard(message)
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


def _maker(channel: Channel) -> session.Speaker:
    if channel.protocol == CHANNEL_PROTOCOL:
        return "ours"
    return "original" if channel.is_first and not channel.protocol else "unknown"
