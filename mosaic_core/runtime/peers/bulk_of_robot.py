"""Answers the operator's offers of a second peer connection, and hands its channels to the peer."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import Any

from mosaic_core.machines.commands.command_order import ArrivalBaseline
from mosaic_core.machines.delivery.send_scheduler import Priority
from mosaic_core.machines.peers import bulk_of_robot as machine
from mosaic_core.runtime.peers.bulk_connection import BulkAttempt, BulkConnection, LaneMessage
from mosaic_core.runtime.peers.control_channel import ControlChannel
from mosaic_core.runtime.peers.peer_channels import PeerChannels
from mosaic_core.runtime.peers.remote_operator import RemoteOperator
from mosaic_core.runtime.transport.peer_congestion import PeerCongestion
from mosaic_core.runtime.transport.transport import Answerer, Channel
from mosaic_core.words.control import CHANNEL_PROTOCOL, LANE_LABEL, LaneAnswer, LaneCandidate, LaneOffer
from mosaic_core.words.errors import MosaicError

logger = logging.getLogger(__name__)


class BulkOfRobot(BulkConnection["_AnsweredAttempt"]):
    """Is the robot's end of the second connection with one operator."""

    def __init__(
        self,
        operator: RemoteOperator,
        channels: PeerChannels,
        congestion: PeerCongestion,
        make_answerer: Callable[[Any], Answerer],
    ) -> None:
        super().__init__(machine.RobotBulkMachine(), operator.answer, operator.peer_id)
        self.channels = channels
        self.operator = operator
        self.congestion = congestion
        self.make_answerer = make_answerer

    def heard(self, message: LaneMessage) -> None:
        match message:
            case LaneOffer(attempt=attempt, sdp=sdp):
                self.tell(machine.OfferHeard(attempt, sdp))
            case LaneCandidate(attempt=attempt):
                self.tell(machine.CandidateHeard(attempt, message.ice_candidate))
            case _:
                super().heard(message)

    def begin(self, effect: machine.AnswerOffer | machine.AddBulkCandidate) -> None:
        match effect:
            case machine.AnswerOffer(attempt, sdp):
                self._attempt = _AnsweredAttempt(attempt, self)
                self.tasks.start(self._attempt.answer(sdp))
            case machine.AddBulkCandidate(candidate) if self._attempt is not None:
                self.tasks.start(self._attempt.add_candidate(candidate))

    def dropped(self, attempt: _AnsweredAttempt | None) -> None:
        if attempt is not None:
            self.channels.drop(attempt.queue)


class _AnsweredAttempt(BulkAttempt[Answerer]):
    """Answers one offer of the bulk connection, and hears what its answerer says of it."""

    media: Any = None
    """It has no lines: no label is given to the answerer."""

    def __init__(self, attempt: int, connection: BulkOfRobot) -> None:
        super().__init__(attempt, connection)
        self.queue = connection.channels.new_queue()
        self._bulk = connection
        self._control: ControlChannel | None = None

    async def answer(self, offer_sdp: str) -> None:
        try:
            self.end = self._bulk.make_answerer(self)
            sdp = await self.end.answer(offer_sdp, (), None)
        except MosaicError as error:
            self.fail(error.code, error.message)
            return
        except Exception as error:  # an offer is foreign input: whatever it breaks, the robot goes on
            text = "the offer of a second connection of peer %s could not be answered"
            logger.exception(text, self._bulk.peer_id)
            self.fail("sdp.invalid", type(error).__name__)
            return
        if self.is_closed:
            await self.close()
            return
        self._bulk.tell(machine.BulkAnswerMade(self.attempt))
        self.describe(LaneAnswer(attempt=self.attempt, sdp=sdp))

    async def close(self) -> None:
        self.queue.close_all()
        await super().close()

    # -- what the transport tells --------------------------------------------------------------------------------

    @property
    def is_local(self) -> bool:
        return self._bulk.operator.is_local

    @property
    def congestion(self) -> PeerCongestion:
        return self._bulk.congestion

    def state_changed(self, state: str) -> None:
        if state == "connected":
            self._bulk.tell(machine.Connected(self.attempt))
        super().state_changed(state)

    def bound_exceeded(self, why: str) -> None:
        self._bulk.operator.log_excess(why)
        self.fail("channel.too_large", why)

    def channel_opened(self, channel: Channel) -> None:
        if self.is_closed:
            return
        if channel.label == LANE_LABEL and channel.protocol == CHANNEL_PROTOCOL:
            if self._control is None:  # it answers pings by itself, and nothing else is said there
                self._control = ControlChannel(channel, self.queue, ArrivalBaseline(), lambda _: None, Priority.BULK)
        else:
            self._bulk.channels.bulk_channel_opened(channel, self.queue)
