"""The operator's end of the second peer connection for bulk data: carries out ``machines.operator_lane``.

Signaling runs over the control channel of the main connection, so that the server need not be there.
"""

from __future__ import annotations

import asyncio
import logging
import random
import time
from collections.abc import Awaitable, Callable, Coroutine, Sequence
from dataclasses import dataclass
from typing import Any

from mosaic_core.machines.delivery.framing import Frame, PayloadKind
from mosaic_core.machines.peers import bulk_of_operator as machine
from mosaic_core.machines.peers.bulk_of_operator import LaneState
from mosaic_core.operator.delivery.data_port import DataPort
from mosaic_core.runtime.transport.operator_transport import IncomingVideo, Offerer, OffererFactory
from mosaic_core.words import control
from mosaic_core.words.control import CHANNEL_PROTOCOL, LANE_LABEL
from mosaic_core.words.data_type import Delivery
from mosaic_core.words.errors import MosaicError
from mosaic_core.words.ice import IceServer
from mosaic_core.words.signaling import IceCandidate

_log = logging.getLogger(__name__)

_FRESH_ICE_TIMEOUT_S = 1.0
"""For the server's fresh credentials; those of the main connection serve as well as long as they are valid."""


@dataclass(frozen=True, slots=True)
class BulkOwner:
    """What a lane needs of its connection. ``changed(lost)``: bulk channels open elsewhere from now on, and those on
    the offerer ``lost`` are gone."""

    make_offerer: OffererFactory
    ice_servers: Sequence[IceServer]
    fresh_ice_servers: Callable[[], Awaitable[Sequence[IceServer]]] | None
    send: Callable[[control.ControlMessage], bool]
    changed: Callable[[Offerer | None], None]


class BulkConnection:
    """Of one main connection. Event loop only."""

    def __init__(self, owner: BulkOwner) -> None:
        self._owner = owner
        self._machine = machine.OperatorBulkMachine()
        self._is_known = False
        self._is_closed = False
        self._transport: _LaneTransport | None = None
        self._timer: asyncio.TimerHandle | None = None
        self._tasks: set[asyncio.Task[None]] = set()

    @property
    def state(self) -> LaneState:
        """``none``: nobody wanted one, or the robot knows none."""
        return self._machine.state

    @property
    def offerer(self) -> Offerer | None:
        """Where bulk channels open; ``None``: on the main connection."""
        return self._transport.offerer if self._transport is not None and self.state == "up" else None

    def greeted(self, *, is_known: bool) -> None:
        """The robot's hello says whether it knows lanes."""
        self._is_known = is_known

    def settled(self) -> bool:
        """A bulk channel is wanted: ``False`` while it should wait, because the lane is being made."""
        if self._is_known and not self._is_closed:
            self.handle(machine.BulkWanted())
        return self.state != "connecting"

    def hear(self, message: control.ControlMessage) -> None:
        """The robot's word about the lane."""
        transport = self._transport
        match message:
            case control.LaneAnswer(attempt=attempt, sdp=sdp) if transport and transport.attempt == attempt:
                self.run(transport.accept(sdp))
            case control.LaneCandidate(attempt=attempt) if transport and transport.attempt == attempt:
                self.run(transport.offerer.add_candidate(message.ice_candidate))
            case control.LaneClose(attempt=attempt, code=code):
                self.handle(machine.BulkAttemptFailed(attempt, code, is_told=True))
            case _:
                pass

    def drop(self) -> None:
        """The main connection is over."""
        self._is_closed = True
        self._rearm()
        transport, self._transport = self._transport, None
        if transport is not None:
            self.run(transport.close())

    async def close(self) -> None:
        """:meth:`drop`, and wait until nothing of it is left."""
        self.drop()
        while self._tasks:
            await asyncio.wait(self._tasks)

    def handle(self, event: machine.Event) -> None:
        """What the transport, or time, tells."""
        if self._is_closed:
            return
        for effect in self._machine.handle(event, time.monotonic(), random.random()):
            match effect:
                case machine.Begin(attempt):
                    self.run(self._begin(attempt))
                case machine.UseLane():
                    self._owner.changed(None)
                case machine.SendBulkPing():
                    if self._transport is not None:
                        self._transport.ping()
                case machine.FallBack(attempt, code, tells_robot):
                    self._fall_back(attempt, code, tells_robot=tells_robot)
        self._rearm()

    def run(self, work: Coroutine[Any, Any, None]) -> None:
        """As a task that :meth:`close` waits for."""
        task = asyncio.create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def _begin(self, attempt: int) -> None:
        servers = await self._fresh_ice_servers()
        if self._is_closed or self._transport is not None or self.state != "connecting":
            return
        transport = self._transport = _LaneTransport(attempt, self, self._owner, servers)
        await transport.offer()

    async def _fresh_ice_servers(self) -> Sequence[IceServer]:
        fresh = self._owner.fresh_ice_servers
        if fresh is None or not self._owner.ice_servers:
            return self._owner.ice_servers
        try:
            async with asyncio.timeout(_FRESH_ICE_TIMEOUT_S):
                return await fresh()
        except (MosaicError, TimeoutError) as error:
            _log.debug("no fresh ICE servers for the second connection: %s", error)
            return self._owner.ice_servers

    def _fall_back(self, attempt: int, code: str, *, tells_robot: bool) -> None:
        _log.info("no second connection for bulk data (%s): it goes over the main one", code)
        if tells_robot:
            self._owner.send(control.LaneClose(attempt=attempt, code=code))
        transport, self._transport = self._transport, None
        if transport is not None:
            self.run(transport.close())
        self._owner.changed(transport.offerer if transport is not None else None)

    def _rearm(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        if self._machine.deadline_s is not None and not self._is_closed:
            delay_s = max(0.0, self._machine.deadline_s - time.monotonic())
            self._timer = asyncio.get_running_loop().call_later(delay_s, self.handle, machine.DeadlinePassed())


class _LaneTransport:
    """One attempt: implements ``OffererListener``."""

    def __init__(self, attempt: int, lane: BulkConnection, owner: BulkOwner, ice_servers: Sequence[IceServer]) -> None:
        self.attempt = attempt
        self.offerer = owner.make_offerer(self, ice_servers)
        self._lane = lane
        self._owner = owner
        self._is_offered = False
        self._is_closed = False
        self._early: list[IceCandidate] = []
        channel = self.offerer.create_channel(LANE_LABEL, protocol=CHANNEL_PROTOCOL)
        channel.give_way(True)
        self._port = DataPort(channel, Delivery.RELIABLE, self._heard, self._changed, max_queued_bytes=None)

    async def offer(self) -> None:
        try:
            sdp, _ = await self.offerer.offer()
        except MosaicError as error:
            self._failed(error.code)
            return
        if self._is_closed:
            return
        if len(sdp) > control.MAX_LANE_SDP_BYTES:
            self._failed("signal.too_large")
            return
        self._owner.send(control.LaneOffer(attempt=self.attempt, sdp=sdp))
        self._is_offered = True
        for candidate in self._early:
            self.candidate_found(candidate)

    async def accept(self, sdp: str) -> None:
        try:
            await self.offerer.accept_answer(sdp)
        except MosaicError as error:
            self._failed(error.code)

    async def close(self) -> None:
        """End it; doing so twice does nothing more."""
        self._is_closed = True
        self._port.close()
        await self.offerer.close()

    def ping(self) -> None:
        now_us = time.monotonic_ns() // 1000
        self._port.send(PayloadKind.JSON, control.Ping(t0=now_us).to_text().encode())

    def _failed(self, code: str) -> None:
        if not self._is_closed:
            self._lane.handle(machine.BulkAttemptFailed(self.attempt, code))

    def _heard(self, frame: Frame) -> None:
        self._lane.handle(machine.BulkHeard(self.attempt))

    def _changed(self, is_open: bool) -> None:
        if is_open:
            self._lane.handle(machine.Opened(self.attempt))
        else:
            self._failed("peer.lost")

    # -- told by the peer connection ---------------------------------------------------------------------------------

    def candidate_found(self, candidate: IceCandidate) -> None:
        if not self._is_offered:
            self._early.append(candidate)
        elif not self._is_closed:
            self._owner.send(control.LaneCandidate.of(self.attempt, candidate))

    def state_changed(self, state: str) -> None:
        if state in ("failed", "closed"):
            self._failed("ice.failed" if self._lane.state == "connecting" else "peer.lost")

    def track_arrived(self, label: str, video: IncomingVideo) -> None:
        video.stop()  # nobody asked for one
