"""Serves one operator on the robot: carries out its peer machine, and routes what its transport and it itself say."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Protocol

from mosaic_core.contract.host import Sender
from mosaic_core.machines.commands.command_order import ArrivalBaseline
from mosaic_core.machines.peers import peer_of_robot as machine
from mosaic_core.runtime.peers.bulk_of_robot import BulkOfRobot
from mosaic_core.runtime.peers.control_channel import ControlChannel
from mosaic_core.runtime.peers.further_offers import FurtherOffers
from mosaic_core.runtime.peers.peer_channels import PeerChannels
from mosaic_core.runtime.peers.peer_control import PeerControl
from mosaic_core.runtime.peers.peer_media import PeerMedia
from mosaic_core.runtime.peers.peer_resume import PeerResume
from mosaic_core.runtime.peers.peer_timeline import PeerTimeline
from mosaic_core.runtime.peers.peer_transport import PeerTransport
from mosaic_core.runtime.peers.remote_operator import RemoteOperator
from mosaic_core.runtime.peers.site import RouteChange, Site
from mosaic_core.runtime.peers.stop_channel import StopChannel
from mosaic_core.runtime.signaling.server_link import Introduction
from mosaic_core.runtime.timing.background_tasks import BackgroundTasks
from mosaic_core.runtime.timing.machine_driver import MachineDriver
from mosaic_core.runtime.transport.peer_congestion import PeerCongestion
from mosaic_core.runtime.transport.transport import Answerer, AnswererFactory, AnswererListener, Channel
from mosaic_core.words import control
from mosaic_core.words.control import CHANNEL_PROTOCOL, CONTROL_LABEL, PING_PERIOD_S, STOP_LABEL
from mosaic_core.words.ice import IceServer
from mosaic_core.words.signaling import IceCandidate

DOUBT_S = 2 * PING_PERIOD_S + 0.2
"""Two pings and the way here."""
_BYE_CHECKS, _BYE_CHECK_S = 50, 0.01
"""A close that the operator hears of before the bye is a loss to him. SCTP tells nobody of a confirmation."""


class PeerKeeper(Protocol):
    """Whoever made a peer and keeps it."""

    def newest_ice_servers(self) -> Sequence[IceServer]:
        """Those of the youngest peer: their credentials live longest."""

    def peer_connected(self, peer: Peer) -> None: ...
    def peer_closed(self, peer: Peer, code: str, message: str) -> None: ...


class Peer:
    """Joins the parts of one operator's connection, from the offer to the end; implements ``AnswererListener``. Event
    loop only."""

    def __init__(
        self, introduction: Introduction, site: Site, keeper: PeerKeeper, make_answerer: AnswererFactory
    ) -> None:
        start, server = introduction.start, introduction.server
        is_program = start.identity.is_program
        is_local = start.is_local and server.is_on_this_machine
        operator = RemoteOperator(introduction.sender, is_program=is_program, is_near=server.is_near, is_local=is_local)
        self.operator = operator
        self.timeline = PeerTimeline(operator)
        self.congestion = PeerCongestion()
        self.connected_at_s: float | None = None
        self._start = start
        self._server = server
        self._site = site
        self._keeper = keeper
        self._make_answerer = make_answerer
        self._tasks = BackgroundTasks()
        self._control = PeerControl(operator, site)
        self._baseline = ArrivalBaseline()
        self._resume = PeerResume(operator, site)
        self._channels = PeerChannels(operator, site, self._resume, self._baseline)
        self.media = PeerMedia(operator, site, self.timeline)
        self._transport = PeerTransport(introduction, site, self.timeline)
        self._offers = FurtherOffers(operator, self._transport.answer_again)
        self._bulk = BulkOfRobot(operator, self._channels, self.congestion, self._bulk_answerer)
        self._machine = machine.RobotPeerMachine(time.monotonic(), is_media_only=machine.is_media_only(start.offer_sdp))
        self._driver = MachineDriver(self._machine, self._carry_out)
        self._closed = asyncio.Event()

    @property
    def sender(self) -> Sender:
        """Who it is, as far as it has said."""
        return self.operator.sender

    @property
    def peer_id(self) -> str:
        return self.operator.peer_id

    @property
    def phase(self) -> machine.Phase:
        return self._machine.phase

    @property
    def channels(self) -> tuple[str, ...]:
        """Labels of the open data channels."""
        return self._channels.labels()

    def _bulk_answerer(self, listener: AnswererListener) -> Answerer:
        return self._make_answerer(listener, self._keeper.newest_ice_servers() or self._start.ice_servers)

    # -- life ----------------------------------------------------------------------------------------------------

    def begin(self) -> None:
        self._driver.start()
        self._tasks.start(self._answer())

    async def _answer(self) -> None:
        self._driver.tell(await self._transport.answer(self._make_answerer, self))
        await self._transport.exchange_candidates()

    def add_candidate(self, candidate: IceCandidate) -> None:
        self.timeline.mark("candidate")
        if self.phase != "closed":
            self._tasks.start(self._transport.add_candidate(candidate))

    def renegotiate(self, offer_sdp: str, tracks: Mapping[str, str] | None) -> None:
        """Answer a further offer that came through the server; a refused one leaves the connection as it is."""
        self._tasks.start(self._answer_again(offer_sdp, tracks))

    async def _answer_again(self, offer_sdp: str, tracks: Mapping[str, str] | None) -> None:
        sdp = await self._offers.answered(offer_sdp, tracks)
        if sdp is None or self.phase == "closed":
            return
        self._transport.tell_answer(sdp)
        if self.phase == "original":
            self.media.show_all()

    def connectors_changed(self, change: RouteChange) -> None:
        """The robot has other connectors than before: tell it, and close what is no more. An operator whose lines of
        pictures or sound lead nowhere any more connects anew; an original one knows only what it asked for."""
        for label in change.removed:
            self._channels.remove(label)
        for label in change.added & self._site.routes.keys():
            self._resume.added(self._site.routes[label])
        for label in change.renewed:
            self._channels.renew(label)
        if self.phase != "open":
            return
        if self.media.has_lines(change.removed):
            self.close("peer.reloaded")
        elif change.is_news:
            self.operator.answer(control.CatalogueFull(catalogue=self._site.catalogue))

    def doubt(self) -> None:
        """The robot's network is another one: operators of ours ping, so a live one is heard soon."""
        self._driver.tell(machine.Doubted(DOUBT_S))

    def close(self, code: str, message: str = "") -> None:
        """Begin to close; an operator of ours hears why."""
        self._driver.tell(machine.CloseRequested(code, message))

    async def closed(self) -> None:
        await self._closed.wait()

    def _carry_out(self, effect: machine.Effect) -> None:
        match effect:
            case machine.TellConnected():
                self.connected_at_s = time.monotonic()
                self._keeper.peer_connected(self)
                self._server.peer_connected(self._start.peer_id)
            case machine.TreatAsOurs():
                self._treat_as_ours()
            case machine.TreatAsOriginal():
                self._treat_as_original()
            case machine.ClosePeer(code, message, say_bye):
                self._end(code, message, say_bye)

    def _treat_as_ours(self) -> None:
        self.media.show_nothing()
        self.operator.answer(control.CatalogueFull(catalogue=self._site.catalogue))
        self.timeline.mark("catalogue")
        self.media.operator_greeted()
        self._control.operator_joined()

    def _treat_as_original(self) -> None:
        self._resume.plain()
        if not self._control.treat_as_original():
            asyncio.get_running_loop().call_soon(self.close, "peer.not_allowed")
        self.media.show_all()

    def _end(self, code: str, message: str, say_bye: bool) -> None:
        if say_bye:
            self.operator.answer(control.Bye(code=code, message=message or None))
        self._transport.give_up()
        self.media.operator_left()
        self._bulk.close()
        self._channels.close_all()
        self._resume.peer_left(code)
        self._control.operator_left(code)
        self.timeline.ended(code, was_connected=self.connected_at_s is not None)
        self._keeper.peer_closed(self, code, message)
        self._server.peer_ended(self._start.peer_id, self, code, message)
        self._tasks.start(self._close_transport(_BYE_CHECKS if say_bye else 0))

    async def _close_transport(self, checks: int) -> None:
        for _ in range(checks):
            if self._channels.queue.is_confirmed:
                break
            await asyncio.sleep(_BYE_CHECK_S)
        self._channels.queue.close_all()
        await self._transport.close()
        await self._bulk.closed()
        self._closed.set()

    # -- what the operator says ----------------------------------------------------------------------------------

    def _control_heard(self, message: control.ControlMessage | None) -> None:
        match message:
            case control.Hello():
                self._said_hello(message)
            case control.Bye():
                self._driver.tell(machine.ByeReceived(message.code, message.message or ""))
            case None:
                self._driver.tell(machine.ControlReceived())
            case _:
                self._driver.tell(machine.ControlReceived())
                self._route(message)

    def _said_hello(self, hello: control.Hello) -> None:
        self.timeline.mark("hello")
        if self.phase not in ("open", "closed"):
            self._control.said_hello(hello)
            self._resume.said_hello(hello)
        self._driver.tell(machine.HelloReceived())

    def _route(self, message: control.ControlMessage) -> None:
        is_open = self.phase == "open"
        match message:
            case control.MediaWatch():
                self.media.watch(message)
            case control.LaneOffer() | control.LaneCandidate() | control.LaneClose():
                if is_open:
                    self._bulk.heard(message)
            case control.RenegotiateOffer():
                if is_open:
                    self._tasks.start(self._offers.take(message))
            case control.Resume() | control.Delivered():
                if is_open:
                    self._resume.resume_heard(message)
            case _:
                self._control.control_heard(message)

    def _stop_channel_heard(
        self, message: control.Stop | control.Pong, answer: Callable[[control.ControlMessage], None]
    ) -> None:
        if self.phase != "closed":
            self._control.control_heard(message, answer)

    # -- what the transport tells --------------------------------------------------------------------------------

    @property
    def is_local(self) -> bool:
        return self.operator.is_local

    def candidate_found(self, candidate: IceCandidate) -> None:
        self._transport.candidate_found(candidate)

    def state_changed(self, state: str) -> None:
        self.timeline.transport_changed(state, self._transport.path())
        self._driver.tell(machine.TransportChanged(state))

    def bound_exceeded(self, why: str) -> None:
        self.operator.log_excess(why)
        self.close("channel.too_large", why)

    def channel_opened(self, channel: Channel) -> None:
        if self.phase == "closed":
            return
        self._driver.tell(machine.ChannelOpened(_maker(channel)))
        if channel.label == CONTROL_LABEL:
            self._control_channel_opened(channel)
        elif channel.label == STOP_LABEL and channel.protocol == CHANNEL_PROTOCOL:
            self.operator.stop_channel = StopChannel(channel, self._stop_channel_heard)
        else:
            self._channels.channel_opened(channel)

    def _control_channel_opened(self, channel: Channel) -> None:
        if self.operator.control_channel is not None or channel.protocol != CHANNEL_PROTOCOL:
            return
        self.timeline.mark("control")
        opened = ControlChannel(channel, self._channels.queue, self._baseline, self._control_heard)
        self.operator.control_channel = opened
        opened.greet(self._site.software, self._site.boot_id)


def _maker(channel: Channel) -> machine.ChannelMaker:
    if channel.protocol == CHANNEL_PROTOCOL:
        return "ours"
    return "original" if channel.is_first and not channel.protocol else "unknown"
