"""Makes one peer connection and keeps it: carries out what ``machines.peers.peer_of_operator`` decides."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Mapping
from typing import Protocol

from mosaic_core.machines.peers import peer_of_operator as machine
from mosaic_core.operator.control.control_channel import ControlChannel
from mosaic_core.operator.peers.connection_plan import ConnectionPlan
from mosaic_core.runtime.timing.background_tasks import BackgroundTasks
from mosaic_core.runtime.timing.machine_driver import MachineDriver
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
    """Is told what becomes of an attempt, on the event loop."""

    def track_arrived(self, label: str, video: IncomingVideo) -> None: ...
    def robot_known(self) -> None:
        """It speaks ``mosaic.1``, or it said no hello in time; the former may still follow the latter."""

    def greeted(self, control: ControlChannel, extensions: Mapping[str, int]) -> None:
        """The robot's hello: what it knows. Told before :meth:`robot_known`."""

    def resume_word(self) -> control.Resume:
        """What to say right after hello: how far the reliable channels are."""

    def control_heard(self, message: control.ControlMessage) -> None: ...
    def ended(self, error: ConnectionFailed) -> None:
        """Told once; everything is being closed."""


class PeerAttempt:
    """Offers one peer connection to the robot, and keeps it alive to its end. Event loop only.

    Implements ``OffererListener`` and ``ControlListener``.
    """

    def __init__(
        self,
        plan: ConnectionPlan,
        owner: PeerOwner,
        make_offerer: OffererFactory,
        signal: Callable[[SignalingMessage], None],
        *,
        was_original: bool = False,
    ) -> None:
        self.is_ours: bool | None = None
        """Whether the robot speaks ``mosaic.1``; ``None`` until it is known."""
        self.voices: dict[str, OutgoingSound] = {}
        """One's own voice for each loudspeaker that was asked for, by label."""
        self._plan = plan
        self._owner = owner
        self._signal = signal
        self._machine = machine.OperatorPeerMachine(time.monotonic(), was_original=was_original)
        self._driver = MachineDriver(self._machine, self._carry_out)
        self._tasks = BackgroundTasks()
        self.offerer = make_offerer(self, plan.ice_servers)
        self._add_lines()
        self.control = self._made_control()

    def _made_control(self) -> ControlChannel:
        create, protocol = self.offerer.create_channel, control.CHANNEL_PROTOCOL
        ours = create(control.CONTROL_LABEL, protocol=protocol)
        stop = create(control.STOP_LABEL, protocol=protocol, ordered=False, max_retransmits=0)
        return ControlChannel(ours, stop, self, clock_us=self._plan.clock_us, is_person=self._plan.is_person)

    async def offer(self) -> None:
        """Send the offer, and watch from now on what comes of it."""
        self._driver.start()
        try:
            sdp, tracks = await self.offerer.offer()
            knows_tracks = "catalogue" in self._plan.agreed and self._plan.catalogue is not None
            named = dict(tracks) if knows_tracks else None
            self._signal(signaling.SdpOffer(rtc_connection_id=self._plan.peer_id, sdp_offer=sdp, tracks=named))
        except MosaicError as error:
            self._driver.tell(machine.EndReceived(error.code, error.message))
            return
        self._mark("offered")
        self._driver.tell(machine.OfferMade())

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
        """Whoever waits for the connection has lost patience."""
        self._driver.tell(machine.PatienceLost())

    def signaled(self, message: SignalingMessage) -> None:
        """A signaling message about this connection."""
        match message:
            case signaling.SdpAnswer(sdp_answer=sdp):
                self._tasks.start(self._accept(sdp))
            case signaling.ExchangeIceCandidate(ice_candidate=candidate):
                self._mark("candidate")
                self._tasks.start(self.offerer.add_candidate(candidate))
            case signaling.ClosePeerConnection(code=code, message=text):
                self._driver.tell(machine.EndReceived(code or "peer.closed", text or ""))
            case _:
                pass

    def doubt(self) -> None:
        """The network is another one: the robot has a few round trips to prove that it is still there."""
        best = self.control.clock.best
        round_trip_s = 0.0 if best is None else best.round_trip_us / 1e6
        self._driver.tell(machine.Doubted(max(DOUBT_S, DOUBT_ROUND_TRIPS * round_trip_s)))

    def robot_returned(self) -> None:
        """The robot has a new connection to the server."""
        self._driver.tell(machine.RobotReturned())

    async def close(self) -> None:
        """Say good-bye and end everything; doing so twice does nothing."""
        self._driver.tell(machine.EndRequested())
        await self.offerer.close()

    def say(self, message: control.ControlMessage) -> bool:
        """Tell the robot, over the control channel; ``False`` while that is not open."""
        return self.control.send(message)

    async def _accept(self, sdp: str) -> None:
        if self._machine.phase != "waiting":
            return
        try:
            await self.offerer.accept_answer(sdp)
        except ConnectionFailed as error:
            self._driver.tell(machine.EndReceived(error.code, error.message))
        else:
            self._mark("answered")
            if "\na=candidate:" in sdp:
                self._mark("candidate", "in the answer")
            self._driver.tell(machine.AnswerReceived())

    def _mark(self, moment: Moment, detail: str = "") -> None:
        self._plan.timeline.mark(moment, time.monotonic(), detail)

    def _mark_transport(self, state: str) -> None:
        if state in ("securing", "connected"):
            path = self.offerer.path()
            where = "" if path is None else f"{path.summary()}: {path.local_address} → {path.remote_address}"
            self._mark("ice", where)
        if state == "connected":
            self._mark("dtls")

    # -- told by the peer connection ---------------------------------------------------------------------------------

    def candidate_found(self, candidate: IceCandidate) -> None:
        self._tell_server(signaling.ExchangeIceCandidate(rtc_connection_id=self._plan.peer_id, ice_candidate=candidate))

    def state_changed(self, state: str) -> None:
        self._mark_transport(state)
        self._driver.tell(machine.TransportChanged(state))

    def track_arrived(self, label: str, video: IncomingVideo) -> None:
        self._owner.track_arrived(label, video)

    # -- told by the control channel ---------------------------------------------------------------------------------

    def control_opened(self) -> None:
        self._mark("control")
        self._driver.tell(machine.ControlOpened())

    def resume_word(self) -> control.Resume:
        return self._owner.resume_word()

    def control_heard(self, message: control.ControlMessage) -> None:
        match message:
            case control.Hello(extensions=extensions):
                if self._machine.phase != "closed":
                    self._owner.greeted(self.control, extensions)
                self._mark("hello")
                self._driver.tell(machine.HelloReceived())
            case control.Bye(code=code, message=text):
                self._driver.tell(machine.EndReceived(code, text or ""))
            case _:
                if isinstance(message, control.CatalogueFull):
                    self._mark("catalogue")
                self._driver.tell(machine.ControlReceived())
                self._owner.control_heard(message)

    # -- the machine -------------------------------------------------------------------------------------------------

    def _carry_out(self, effect: machine.Effect) -> None:
        match effect:
            case machine.SendPing():
                self.control.ping()
            case machine.UseConnection(is_ours):
                self.is_ours = is_ours
                self._owner.robot_known()
            case machine.End():
                self._end(effect)

    def _end(self, end: machine.End) -> None:
        known = end.code if end.code in REASONS else "peer.closed"
        self._plan.timeline.end(known, time.monotonic())
        if end.tells_robot:
            if self.is_ours:
                self.control.send(control.Bye())
            # a robot keeps what belongs to a session that was lost, and forgets it on a good-bye
            code = known if "closeReasons" in self._plan.agreed and known != "peer.closed" else None
            self._tell_server(signaling.ClosePeerConnection(rtc_connection_id=self._plan.peer_id, code=code))
        self._tasks.start(self.offerer.close())
        self._owner.ended(ConnectionFailed(end.message or reason(known).sentence, code=known))

    def _tell_server(self, message: SignalingMessage) -> None:
        """Best effort: a connection lives on while the server is away."""
        try:
            self._signal(message)
        except MosaicError as error:
            _log.debug("the server could not be told: %s", error.message)
