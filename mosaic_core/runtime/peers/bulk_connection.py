"""The robot's end of the second peer connection of one operator: bulk data only, so that commands never wait behind it.

It is made over the control channel of the first one, lives no longer than that, and carries neither control nor media.
"""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Callable, Coroutine, Sequence
from dataclasses import dataclass
from typing import Any

from mosaic_core.contract.host import Loss
from mosaic_core.machines.commands.command_gate import ArrivalBaseline
from mosaic_core.machines.delivery.send_scheduler import Priority
from mosaic_core.machines.peers import bulk_of_robot as machine
from mosaic_core.runtime.delivery.send_queue import SendQueue
from mosaic_core.runtime.media.plain_stream import NewestFeed
from mosaic_core.runtime.peers.control_channel import ControlChannel
from mosaic_core.runtime.transport.picture_transport import PictureFeed
from mosaic_core.runtime.transport.sound_transport import IncomingSound
from mosaic_core.runtime.transport.transport import Answerer, AnswererFactory, Channel
from mosaic_core.words import control
from mosaic_core.words.control import CHANNEL_PROTOCOL, LANE_LABEL, ControlMessage
from mosaic_core.words.errors import MosaicError
from mosaic_core.words.ice import IceServer
from mosaic_core.words.signaling import IceCandidate

logger = logging.getLogger(__name__)

LaneMessage = control.LaneOffer | control.LaneAnswer | control.LaneCandidate | control.LaneClose


@dataclass(frozen=True, slots=True)
class BulkOwner:
    """What a lane needs of its peer. ``opened``: a channel of a connector, and the queue that fills it; ``dropped``:
    the channels of that queue are gone; ``has_room``, ``left_out``: as of every send queue."""

    peer_id: str
    make_answerer: AnswererFactory
    ice_servers: Callable[[], Sequence[IceServer]]
    tell: Callable[[ControlMessage], None]
    opened: Callable[[Channel, SendQueue], None]
    dropped: Callable[[SendQueue], None]
    has_room: Callable[[str], None]
    left_out: Callable[[str, Loss, int], None]


class BulkConnection:
    """Carries out ``machines.robot_lane`` for one peer. Event loop only."""

    def __init__(self, owner: BulkOwner) -> None:
        self._owner = owner
        self._loop = asyncio.get_running_loop()
        self._machine = machine.RobotBulkMachine()
        self._transport: _LaneTransport | None = None
        self._timer: asyncio.TimerHandle | None = None
        self._tasks: set[asyncio.Task[None]] = set()
        self._is_closed = False

    @property
    def phase(self) -> str:
        return self._machine.phase

    def heard(self, message: LaneMessage) -> None:
        """The operator's word about the lane."""
        match message:
            case control.LaneOffer(attempt=attempt, sdp=sdp):
                self.handle(machine.OfferHeard(attempt, sdp))
            case control.LaneCandidate(attempt=attempt):
                self.handle(machine.CandidateHeard(attempt, message.ice_candidate))
            case control.LaneClose(attempt=attempt):
                self.handle(machine.CloseHeard(attempt))
            case _:
                pass

    def close(self) -> None:
        """The main connection is over, and with it the lane."""
        self._is_closed = True
        self._drop()
        self._rearm()

    async def closed(self) -> None:
        """After :meth:`close`: until nothing of it is left."""
        while self._tasks:
            await asyncio.wait(self._tasks)

    def handle(self, event: machine.Event) -> None:
        """What the transport, or time, tells."""
        if self._is_closed:
            return
        for effect in self._machine.handle(event, time.monotonic()):
            match effect:
                case machine.AnswerOffer(attempt, sdp):
                    self._transport = _LaneTransport(attempt, self, self._owner)
                    self.run(self._transport.answer(sdp))
                case machine.AddBulkCandidate(candidate):
                    if self._transport is not None:
                        self._transport.add_candidate(candidate)
                case machine.DropTransport():
                    self._drop()
                case machine.TellClosed(attempt, code, message):
                    fields = {"peerId": self._owner.peer_id, "code": code}
                    logger.info("no second connection for bulk data (%s) %s", code, message, extra=fields)
                    self._owner.tell(control.LaneClose(attempt=attempt, code=code, message=message[:500] or None))
        self._rearm()

    def run(self, work: Coroutine[Any, Any, None]) -> None:
        """As a task that :meth:`closed` waits for."""
        task = self._loop.create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    def _drop(self) -> None:
        transport, self._transport = self._transport, None
        if transport is not None:
            self._owner.dropped(transport.queue)
            self.run(transport.close())

    def _rearm(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        if self._machine.deadline_s is not None and not self._is_closed:
            delay_s = max(0.0, self._machine.deadline_s - time.monotonic())
            self._timer = self._loop.call_later(delay_s, self.handle, machine.DeadlinePassed())


class _LaneTransport:
    """One attempt: implements ``AnswererListener``."""

    def __init__(self, attempt: int, lane: BulkConnection, owner: BulkOwner) -> None:
        self.queue = SendQueue(owner.has_room, owner.left_out)
        self._attempt = attempt
        self._lane = lane
        self._owner = owner
        self._answerer: Answerer | None = None
        self._early: list[IceCandidate] | None = []
        self._theirs: list[IceCandidate] | None = []
        self._link: ControlChannel | None = None
        self._is_closed = False

    async def answer(self, offer_sdp: str) -> None:
        try:
            self._answerer = self._owner.make_answerer(self, self._owner.ice_servers())
            sdp = await self._answerer.answer(offer_sdp, (), None)
        except MosaicError as error:
            self._failed(error.code, error.message)
            return
        except Exception as error:  # an offer is foreign input: whatever it breaks, the robot goes on
            logger.exception("the offer of a second connection of peer %s could not be answered", self._owner.peer_id)
            self._failed("sdp.invalid", type(error).__name__)
            return
        if self._is_closed:
            await self.close()
            return
        self._owner.tell(control.LaneAnswer(attempt=self._attempt, sdp=sdp))
        self._lane.handle(machine.BulkAnswerMade(self._attempt))
        early, self._early = self._early or [], None
        for candidate in early:
            self.candidate_found(candidate)
        theirs, self._theirs = self._theirs or [], None
        for candidate in theirs:
            await self._answerer.add_candidate(candidate)

    def add_candidate(self, candidate: IceCandidate) -> None:
        """A remote one; those that come before the offer is answered wait."""
        if self._theirs is not None:
            self._theirs.append(candidate)
        elif self._answerer is not None:
            self._lane.run(self._answerer.add_candidate(candidate))

    async def close(self) -> None:
        """End it; doing so twice does nothing more."""
        self._is_closed = True
        self.queue.close_all()
        if self._answerer is None:
            return
        try:
            await self._answerer.close()
        except Exception:  # it is over either way, but whoever looks for a leak must find it
            logger.warning("a second connection of peer %s did not close cleanly", self._owner.peer_id, exc_info=True)

    def _failed(self, code: str, message: str) -> None:
        self._lane.handle(machine.BulkTransportFailed(self._attempt, code, message))

    # -- what the transport tells --------------------------------------------------------------------------------

    def candidate_found(self, candidate: IceCandidate) -> None:
        if self._early is not None:
            self._early.append(candidate)
        elif not self._is_closed:
            self._owner.tell(control.LaneCandidate.of(self._attempt, candidate))

    def state_changed(self, state: str) -> None:
        if state == "connected":
            self._lane.handle(machine.Connected(self._attempt))
        elif state in ("failed", "closed"):
            self._failed("ice.failed" if self._lane.phase != "up" else "peer.lost", "")

    def channel_opened(self, channel: Channel) -> None:
        if self._is_closed:
            return
        if channel.label == LANE_LABEL and channel.protocol == CHANNEL_PROTOCOL:
            if self._link is None:  # it answers pings by itself, and nothing else is said there
                self._link = ControlChannel(channel, self.queue, ArrivalBaseline(), lambda _: None, Priority.BULK)
        else:
            self._owner.opened(channel, self.queue)

    def track_bound(self, label: str) -> PictureFeed:
        """Never told: no label was given to the answerer."""
        return NewestFeed()

    def voice_bound(self, label: str, sound: IncomingSound) -> None:
        sound.stop()

    def tracks_unbound(self, labels: Sequence[str]) -> None:
        """There are none."""

    def track_refused(self, label: str, cause: str) -> None:
        """There are none."""

    def origin_known(self, label: str, ssrc: int, rtp_origin: int) -> None:
        """There are none."""
