"""Offers the robot a second peer connection for bulk data, as soon as the first store wants it."""

from __future__ import annotations

import asyncio
import logging
import random
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Protocol

from mosaic_core.machines.delivery.framing import Frame, PayloadKind
from mosaic_core.machines.peers import bulk_of_operator as machine
from mosaic_core.machines.peers.bulk_of_operator import BulkState
from mosaic_core.operator.delivery.data_port import DataPort
from mosaic_core.operator.peers.connection_plan import ConnectionPlan
from mosaic_core.runtime.peers.bulk_connection import BulkAttempt, BulkConnection, LaneMessage
from mosaic_core.runtime.transport.operator_transport import IncomingVideo, Offerer, OffererFactory
from mosaic_core.words import control
from mosaic_core.words.control import CHANNEL_PROTOCOL, LANE_LABEL, ControlMessage
from mosaic_core.words.data_type import Delivery
from mosaic_core.words.errors import MosaicError
from mosaic_core.words.ice import IceServer

_log = logging.getLogger(__name__)

_FRESH_ICE_TIMEOUT_S = 1.0
"""For the server's fresh credentials; those of the main connection serve as well as long as they are valid."""


class BulkUser(Protocol):
    """Opens the bulk channels, where there is a second connection on it."""

    def bulk_changed(self, lost: Offerer | None) -> None:
        """Bulk channels open elsewhere from now on, and those on the offerer ``lost`` are gone."""


class BulkOfOperator(BulkConnection["_OfferedAttempt"]):
    """Is the operator's end of the second connection with one robot."""

    def __init__(
        self,
        plan: ConnectionPlan,
        make_offerer: OffererFactory,
        say: Callable[[ControlMessage], object],
        user: BulkUser,
    ) -> None:
        self._machine = machine.OperatorBulkMachine(random.random)
        super().__init__(self._machine, say, plan.peer_id)
        self._plan = plan
        self._make_offerer = make_offerer
        self._user = user
        self._is_known = False

    @property
    def state(self) -> BulkState:
        """``none``: nobody wanted one, or the robot knows none."""
        return self._machine.state

    @property
    def offerer(self) -> Offerer | None:
        """Where bulk channels open; ``None``: on the main connection."""
        return self._attempt.end if self._attempt is not None and self.state == "up" else None

    def greeted(self, extensions: Mapping[str, int]) -> None:
        """The robot's hello says whether it knows second connections."""
        self._is_known = "bulkLane" in extensions and self._plan.uses_bulk_lane

    def settled(self) -> bool:
        """A bulk channel is wanted: ``False`` while it should wait, because the second connection is being made."""
        if self._is_known:
            self.tell(machine.BulkWanted())
        return self.state != "connecting"

    def heard(self, message: LaneMessage) -> None:
        attempt = self._attempt if self._attempt and self._attempt.attempt == message.attempt else None
        match message:
            case control.LaneAnswer(sdp=sdp) if attempt is not None:
                self.tasks.start(attempt.accept(sdp))
            case control.LaneCandidate() if attempt is not None:
                self.tasks.start(attempt.add_candidate(message.ice_candidate))
            case control.LaneClose(code=code):
                _log.info("the robot makes no second connection for bulk data (%s)", code)
                super().heard(message)
            case _:
                pass

    def begin(self, effect: machine.Begin | machine.UseBulk | machine.SendBulkPing) -> None:
        match effect:
            case machine.Begin(attempt):
                self.tasks.start(self._begin(attempt))
            case machine.UseBulk():
                self._user.bulk_changed(None)
            case machine.SendBulkPing() if self._attempt is not None:
                self._attempt.ping()

    def dropped(self, attempt: _OfferedAttempt | None) -> None:
        self._user.bulk_changed(None if attempt is None else attempt.end)

    async def _begin(self, attempt: int) -> None:
        servers = await self._fresh_ice_servers()
        if self._is_closed or self._attempt is not None or self.state != "connecting":
            return
        self._attempt = _OfferedAttempt(attempt, self, servers, self._make_offerer)
        await self._attempt.offer()

    async def _fresh_ice_servers(self) -> Sequence[IceServer]:
        fresh = self._plan.fresh_ice_servers
        if fresh is None or not self._plan.ice_servers:
            return self._plan.ice_servers
        try:
            async with asyncio.timeout(_FRESH_ICE_TIMEOUT_S):
                return await fresh()
        except (MosaicError, TimeoutError) as error:
            _log.debug("no fresh ICE servers for the second connection: %s", error)
            return self._plan.ice_servers


class _OfferedAttempt(BulkAttempt[Offerer]):
    """Makes one offer of the bulk connection, and hears what its offerer says of it."""

    end: Offerer

    def __init__(
        self, attempt: int, bulk: BulkOfOperator, ice_servers: Sequence[IceServer], make_offerer: OffererFactory
    ) -> None:
        super().__init__(attempt, bulk)
        self._bulk = bulk
        self.end = make_offerer(self, ice_servers)
        channel = self.end.create_channel(LANE_LABEL, protocol=CHANNEL_PROTOCOL)
        channel.give_way(True)
        self._port = DataPort(channel, Delivery.RELIABLE, self._heard, self._changed, max_queued_bytes=None)

    async def offer(self) -> None:
        try:
            sdp, _ = await self.end.offer()
        except MosaicError as error:
            self.fail(error.code)
            return
        if len(sdp) > control.MAX_LANE_SDP_BYTES:
            self.fail("signal.too_large")
        elif not self.is_closed:
            self.describe(control.LaneOffer(attempt=self.attempt, sdp=sdp))

    async def accept(self, sdp: str) -> None:
        try:
            await self.end.accept_answer(sdp)
        except MosaicError as error:
            self.fail(error.code)

    async def close(self) -> None:
        self._port.close()
        await super().close()

    def ping(self) -> None:
        """Ask for a sign of life."""
        now_us = time.monotonic_ns() // 1000
        self._port.send(PayloadKind.JSON, control.Ping(t0=now_us).to_text().encode())

    def track_arrived(self, label: str, video: IncomingVideo) -> None:
        video.stop()  # nobody asked for one

    def _heard(self, frame: Frame) -> None:
        self._bulk.tell(machine.BulkHeard(self.attempt))

    def _changed(self, is_open: bool) -> None:
        if is_open:
            self._bulk.tell(machine.Opened(self.attempt))
        else:
            self.fail("peer.lost")
