"""A sender that outruns its link, over real peer connections: queues stay bounded, the newest value stays young."""

from __future__ import annotations

import asyncio
import statistics
import time
from dataclasses import dataclass, field
from typing import Any

import pytest

from mosaic_core.adapters.peers.aiortc_answerer import AiortcAnswerer
from mosaic_core.contract.host import Outgoing
from mosaic_core.laboratory.impaired_answerer import impaired
from mosaic_core.laboratory.impaired_path import ImpairedPath
from mosaic_core.machines.commands.command_order import ArrivalBaseline
from mosaic_core.machines.delivery.delivery_terms import terms_of
from mosaic_core.machines.delivery.framing import Frame, PayloadKind
from mosaic_core.machines.delivery.send_scheduler import HIGH_WATER_BYTES, Offered
from mosaic_core.machines.laboratory.impaired_link import LinkProfile
from mosaic_core.operator.delivery.data_port import DataPort as OperatorPort
from mosaic_core.operator.delivery.store_counters import StoreCounters
from mosaic_core.runtime.delivery.data_port import DataPort
from mosaic_core.runtime.delivery.outbox import Outbox
from mosaic_core.runtime.delivery.send_queue import SendQueue
from mosaic_core.runtime.observation.counters import ConnectorCounters
from mosaic_core.runtime.transport.transport import Channel
from mosaic_core.words.control import CHANNEL_PROTOCOL
from mosaic_core.words.data_type import Delivery
from mosaic_core.words.delivery import DeliveryContract

pytestmark = pytest.mark.webrtc
WAIT_S = 30.0
ROUTER = LinkProfile("narrow", delay_ms=10, rate_mbps=2, queue_ms=500)
FLOOD_S = 3.0
CONTRACTS = {
    "pose": DeliveryContract(mode=Delivery.LATEST),
    "events": DeliveryContract(queue_messages=64, queue_bytes=256 * 1024),
}
EVENT = bytes(8 * 1024)


class RobotEnd:
    """Outbox, scheduler and channels as a robot has them."""

    def __init__(self, channels: dict[str, Channel]) -> None:
        self._channels = channels
        self.promised: list[int] = []
        """The events that have to arrive."""
        self.outbox = Outbox(asyncio.get_running_loop(), lambda channel, on: None)
        self._queue = SendQueue(lambda label: self.outbox.has_room(label, "p"))
        self._ports = {label: DataPort(channel, ArrivalBaseline()) for label, channel in channels.items()}
        self.counters = {label: ConnectorCounters() for label in channels}
        for label, channel in channels.items():
            terms = terms_of(CONTRACTS[label])
            self.outbox.add_channel(label, terms, self.counters[label])
            self._queue.open(channel, terms.priority, terms.limits)
            self.outbox.join(label, "p", self)

    def deliver(self, message: Outgoing) -> Offered:
        offered = self._queue.offer(self._ports[message.channel].outgoing(message))
        if message.channel == "events" and offered is Offered.QUEUED:
            self.promised.append(int(message.payload[:8]))
        return offered

    def waiting(self, channel: str) -> tuple[int, int]:
        return self._queue.waiting(channel)

    def send(self, label: str, payload: bytes) -> bool:
        return self.outbox.post(Outgoing(label, PayloadKind.BYTES, payload, time.monotonic_ns() // 1000))

    def check_bounds(self) -> None:
        for label, contract in CONTRACTS.items():
            messages, size_bytes = self.outbox.waiting(label)
            limits = terms_of(contract).limits
            assert messages <= limits.messages
            assert size_bytes <= limits.size_bytes
        assert self._channels["pose"].buffered_bytes <= HIGH_WATER_BYTES + len(EVENT) * 2


@dataclass
class OperatorEnd:
    ages_s: list[float] = field(default_factory=list)
    poses: list[int] = field(default_factory=list)
    events: list[int] = field(default_factory=list)

    def pose(self, frame: Frame) -> None:
        self.ages_s.append(time.monotonic() - frame.stamp_us / 1e6)
        self.poses.append(int(frame.payload[:8]))

    def event(self, frame: Frame) -> None:
        self.events.append(int(frame.payload[:8]))


def test_a_sender_that_outruns_a_narrow_link_keeps_its_queues_short_and_its_newest_value_young(pair: Any) -> None:
    operator, pose_counters = OperatorEnd(), StoreCounters()

    async def flood(robot: RobotEnd) -> None:
        end_s, number = time.monotonic() + FLOOD_S, 0
        while time.monotonic() < end_s:
            number += 1
            robot.send("pose", b"%08d" % number + bytes(400))
            robot.send("events", b"%08d" % number + EVENT)
            robot.check_bounds()
            await asyncio.sleep(0.005)

    async def scenario(path: ImpairedPath) -> RobotEnd:
        async with pair() as peers:
            peers.robot = impaired(AiortcAnswerer, path)(peers.robot_side, ())
            peers.operator_side.other = peers.robot
            opened = {label: asyncio.Event() for label in CONTRACTS}

            def port(label: str, delivery: Delivery, got: Any, counters: StoreCounters, **options: Any) -> OperatorPort:
                channel = peers.operator.create_channel(label, protocol=CHANNEL_PROTOCOL, **options)
                return OperatorPort(channel, delivery, got, lambda on: opened[label].set(), counters=counters)

            lossy = {"ordered": False, "max_retransmits": 0}
            ports = (
                port("pose", Delivery.LATEST, operator.pose, pose_counters, **lossy),
                port("events", Delivery.RELIABLE, operator.event, StoreCounters()),
            )
            await peers.join()
            await asyncio.wait_for(asyncio.gather(*(event.wait() for event in opened.values())), WAIT_S)
            channels: dict[str, Channel] = {}
            while len(channels) < len(CONTRACTS):
                channel = await asyncio.wait_for(peers.robot_side.channels.get(), WAIT_S)
                channels[channel.label] = channel
            robot = RobotEnd(channels)
            path.become(ROUTER)
            await flood(robot)
            async with asyncio.timeout(WAIT_S):
                while True:
                    if len(operator.events) == len(robot.promised):
                        break
                    await asyncio.sleep(0.02)
            assert all(one.is_open for one in ports)
            return robot

    with ImpairedPath() as path:
        robot = asyncio.run(scenario(path))
    assert robot.counters["pose"].replaced > 0
    assert robot.counters["events"].dropped > 0, "a reliable sender is told that it is too fast"
    assert len(operator.poses) > 5 * FLOOD_S, "values get through beside data that outruns the link"
    assert operator.poses == sorted(operator.poses)
    assert statistics.median(operator.ages_s) < 0.4
    assert operator.events == robot.promised
    assert pose_counters.received >= len(operator.poses)
