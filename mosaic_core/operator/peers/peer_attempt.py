"""Makes one peer connection and keeps it: carries out what ``machines.operator_peer`` decides."""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Callable, Coroutine, Mapping
from typing import Any, Protocol

from mosaic_core.machines.peers import peer_of_operator as machine
from mosaic_core.operator.control.control_channel import ControlChannel
from mosaic_core.operator.peers.connection_plan import ConnectionPlan
from mosaic_core.runtime.transport.operator_transport import IncomingVideo, OffererFactory, OutgoingSound
from mosaic_core.words import control, signaling
from mosaic_core.words.codes import REASONS, reason
from mosaic_core.words.data_type import Direction, Kind
from mosaic_core.words.errors import ConnectionFailed, MosaicError
from mosaic_core.words.signaling import IceCandidate, SignalingMessage
from mosaic_core.words.timeline import Moment

_log = logging.getLogger(__name__)

DOUBT_S = 0.7
"""Patience with a robot after a change of network; a live one answers a ping within a round trip."""
DOUBT_ROUND_TRIPS = 4


class PeerOwner(Protocol):
    """Whom the link tells; all on the event loop."""

    def track_arrived(self, label: str, video: IncomingVideo) -> None: ...
    def robot_known(self, is_ours: bool) -> None:
        """It speaks ``mosaic.1``, or it said no hello in time; the former may still follow the latter."""
        ...

    def greeted(self, port: ControlChannel, extensions: Mapping[str, int]) -> None:
        """The robot's hello: what it knows. Told before :meth:`robot_known`."""
        ...

    def word(self) -> control.Resume:
        """What to say right after hello: how far the reliable channels are."""
        ...

    def control_heard(self, message: control.ControlMessage) -> None: ...
    def ended(self, error: ConnectionFailed) -> None:
        """Told once; everything is being closed."""
        ...


class PeerAttempt:
    """Implements ``OffererListener``. Event loop only."""

    def __init__(
        self,
        plan: ConnectionPlan,
        owner: PeerOwner,
        make_offerer: OffererFactory,
        send: Callable[[SignalingMessage], None],
        *,
        was_original: bool = False,
    ) -> None:
        self.offerer = make_offerer(self, plan.ice_servers)
        self.control: ControlChannel | None = None
        self.voices: dict[str, OutgoingSound] = {}
        """One's own voice for each loudspeaker that was asked for, by label."""
        self._plan = plan
        self._owner = owner
        self._send = send
        self._machine = machine.OperatorPeerMachine(time.monotonic(), was_original=was_original)
        self._is_ours = False
        self._woken = asyncio.Event()
        self._tasks: set[asyncio.Task[None]] = set()
        self._clock: asyncio.Task[None] | None = None

    async def offer(self) -> None:
        """Start: create the lines and the control channel, and send the offer."""
        self._clock = asyncio.create_task(self._keep_time())
        self._add_lines()
        channel = self.offerer.create_channel(control.CONTROL_LABEL, protocol=control.CHANNEL_PROTOCOL)
        self.control = ControlChannel(
            channel,
            self._heard,
            clock_us=self._plan.clock_us,
            is_person=self._plan.is_person,
            opened=self._control_opened,
            word=self._owner.word,
        )
        stop = self.offerer.create_channel(
            control.STOP_LABEL, protocol=control.CHANNEL_PROTOCOL, ordered=False, max_retransmits=0
        )
        self.control.add_stop_channel(stop)
        try:
            sdp, tracks = await self.offerer.offer()
            knows_tracks = "catalogue" in self._plan.agreed and self._plan.catalogue is not None
            named = dict(tracks) if knows_tracks else None
            self._send(signaling.SdpOffer(rtc_connection_id=self._plan.peer_id, sdp_offer=sdp, tracks=named))
        except MosaicError as error:
            self._handle(machine.EndReceived(error.code, error.message))
            return
        self._mark("offered")
        self._handle(machine.OfferMade())

    def _add_lines(self) -> None:
        """Pictures first: an original robot takes lines in their order, and knows no sound."""
        entries = self._plan.catalogue.entries if self._plan.catalogue is not None else ()
        sound = {entry.label: entry.direction for entry in entries if entry.kind is Kind.AUDIO}
        for label in self._plan.media_labels:
            if label not in sound:
                self.offerer.add_video(label)
        for label in self._plan.media_labels:
            if sound.get(label) is Direction.TO_ROBOT:
                self.voices[label] = self.offerer.add_speaker(label)
            elif label in sound:
                self.offerer.add_microphone(label)

    def time_out(self) -> None:
        """Whoever waits for the connection has lost patience; the phase names the code."""
        code = machine.TIMEOUTS.get(self._machine.phase, (0.0, "channel.timeout"))[1]
        self._end_with(machine.End(code, "", tells_robot=True))

    def hear(self, message: SignalingMessage) -> None:
        """A signaling message about this connection."""
        match message:
            case signaling.SdpAnswer(sdp_answer=sdp):
                self._run(self._accept(sdp))
            case signaling.ExchangeIceCandidate(ice_candidate=candidate):
                self._mark("candidate")
                self._run(self.offerer.add_candidate(candidate))
            case signaling.ClosePeerConnection(code=code, message=text):
                self._handle(machine.EndReceived(code or "peer.closed", text or ""))
            case _:
                pass

    def doubt(self) -> None:
        """The network is another one: the robot has a few round trips to prove that it is still there."""
        best_us = self.control.best_round_trip_us if self.control is not None else None
        self._handle(machine.Doubted(max(DOUBT_S, DOUBT_ROUND_TRIPS * (best_us or 0) / 1e6)))

    def robot_returned(self) -> None:
        """The robot has a new connection to the server."""
        self._handle(machine.RobotReturned())

    async def close(self) -> None:
        """Say good-bye and end everything; doing so twice does nothing."""
        self._handle(machine.EndRequested())
        if self._clock is not None:
            self._clock.cancel()
        await self.offerer.close()

    def say(self, message: control.ControlMessage) -> bool:
        """Tell the robot, over the control channel; ``False`` where there is none (yet)."""
        return self.control is not None and self.control.send(message)

    async def _accept(self, sdp: str) -> None:
        if self._machine.phase != "waiting":
            return
        try:
            await self.offerer.accept_answer(sdp)
        except ConnectionFailed as error:
            self._handle(machine.EndReceived(error.code, error.message))
        else:
            self._mark("answered")
            if "\na=candidate:" in sdp:
                self._mark("candidate", "in the answer")
            self._handle(machine.AnswerReceived())

    def _mark(self, moment: Moment, detail: str = "") -> None:
        self._plan.timeline.mark(moment, time.monotonic(), detail)

    def _mark_transport(self, state: str) -> None:
        if state in ("securing", "connected"):
            path = self.offerer.path()
            where = "" if path is None else f"{path.summary()}: {path.local_address} → {path.remote_address}"
            self._mark("ice", where)
        if state == "connected":
            self._mark("dtls")

    def to_ours_us(self, theirs_us: int) -> int | None:
        """A moment of the robot's clock on ours; ``None`` before the first pong. Good after the connection has ended
        too, for what came over it."""
        return self.control.to_ours_us(theirs_us) if self.control is not None else None

    def _control_opened(self) -> None:
        self._mark("control")
        self._handle(machine.ControlOpened())

    # -- told by the peer connection ---------------------------------------------------------------------------------

    def candidate_found(self, candidate: IceCandidate) -> None:
        self._tell_server(signaling.ExchangeIceCandidate(rtc_connection_id=self._plan.peer_id, ice_candidate=candidate))

    def state_changed(self, state: str) -> None:
        self._mark_transport(state)
        self._handle(machine.TransportChanged(state))

    def track_arrived(self, label: str, video: IncomingVideo) -> None:
        self._owner.track_arrived(label, video)

    def _heard(self, message: control.ControlMessage) -> None:
        match message:
            case control.Hello(extensions=extensions):
                if self.control is not None and self._machine.phase != "closed":
                    self._owner.greeted(self.control, extensions)
                self._mark("hello")
                self._handle(machine.HelloReceived())
            case control.Bye(code=code, message=text):
                self._handle(machine.EndReceived(code, text or ""))
            case _:
                if isinstance(message, control.CatalogueFull):
                    self._mark("catalogue")
                self._handle(machine.ControlReceived())
                self._owner.control_heard(message)

    # -- the machine -------------------------------------------------------------------------------------------------

    def _handle(self, event: machine.Event) -> None:
        for effect in self._machine.handle(event, time.monotonic()):
            match effect:
                case machine.SendPing():
                    if self.control is not None:
                        self.control.ping()
                case machine.UseConnection(is_ours):
                    self._is_ours = is_ours
                    self._owner.robot_known(is_ours)
                case machine.End():
                    self._end(effect)
        self._woken.set()

    def _end_with(self, end: machine.End) -> None:
        if self._machine.phase != "closed":
            self._machine.handle(machine.EndRequested(), time.monotonic())
            self._end(end)

    def _end(self, end: machine.End) -> None:
        known = end.code if end.code in REASONS else "peer.closed"
        self._plan.timeline.end(known, time.monotonic())
        if end.tells_robot:
            if self.control is not None and self._is_ours:
                self.control.send(control.Bye())
            # a robot keeps what belongs to a session that was lost, and forgets it on a good-bye
            code = known if "closeReasons" in self._plan.agreed and known != "peer.closed" else None
            self._tell_server(signaling.ClosePeerConnection(rtc_connection_id=self._plan.peer_id, code=code))
        self._run(self.offerer.close())
        self._owner.ended(ConnectionFailed(end.message or reason(known).sentence, code=known))

    def _tell_server(self, message: SignalingMessage) -> None:
        """Best effort: a connection lives on while the server is away."""
        try:
            self._send(message)
        except MosaicError as error:
            _log.debug("the server could not be told: %s", error.message)

    async def _keep_time(self) -> None:
        while self._machine.phase != "closed":
            self._woken.clear()
            deadline_s = self._machine.deadline_s
            try:
                async with asyncio.timeout(None if deadline_s is None else deadline_s - time.monotonic()):
                    await self._woken.wait()
            except TimeoutError:
                self._handle(machine.DeadlinePassed())

    def _run(self, work: Coroutine[Any, Any, None]) -> None:
        task = asyncio.create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
