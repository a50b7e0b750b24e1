"""What the robot can tell from the numbers and stamps of an operator's commands after its link has stalled."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import count
from typing import Any

import pytest

from mosaic_core.machines.commands.release_first import CommandPauses
from mosaic_core.machines.delivery.framing import PayloadKind
from mosaic_core.operator.delivery.data_port import DataPort
from mosaic_core.words.control import CHANNEL_PROTOCOL
from mosaic_core.words.data_type import Delivery
from tests.operator.conftest import FakeChannel

PERIOD_S = 0.05
PATIENCE_S = 0.5


class Commander:
    """Sends a command every 50 ms of its own clock; the link may stall meanwhile."""

    def __init__(self, delivery: Delivery) -> None:
        self.channel = FakeChannel("cmd_vel", CHANNEL_PROTOCOL, ordered=False, max_retransmits=0)
        self.channel.open()
        self._ticks: Iterator[int] = count(1)
        self.now_s = 0.0
        ignored: Any = lambda _: None  # noqa: E731 - nothing comes back here
        self.port = DataPort(self.channel, delivery, ignored, ignored, clock_us=lambda: round(self.now_s * 1e6))

    def sends(self, commands: int) -> None:
        for _ in range(commands):
            self.now_s = next(self._ticks) * PERIOD_S
            self.port.send(PayloadKind.JSON, b"{}")

    def stalls(self, commands: int) -> None:
        self.channel.buffered_bytes = 100_000
        self.sends(commands)
        self.channel.buffered_bytes = 0
        assert self.channel.on_drained is not None
        self.channel.on_drained()

    def pauses_s(self) -> list[float]:
        """As the robot takes them, from frames that arrive as soon as they left."""
        pauses = CommandPauses(-10.0)
        return [pauses.arrived(frame.seq, frame.stamp_us / 1e6, frame.stamp_us) for frame in self.channel.frames()]


@pytest.mark.parametrize("delivery", [Delivery.LATEST, Delivery.RELIABLE])
def test_who_sends_on_through_a_stall_has_not_paused(delivery: Delivery) -> None:
    commander = Commander(delivery)
    commander.sends(1)
    commander.stalls(40)
    commander.sends(2)
    assert max(commander.pauses_s()[1:]) < PATIENCE_S


def test_who_is_silent_has_paused() -> None:
    commander = Commander(Delivery.LATEST)
    commander.sends(1)
    commander.now_s += 1.0
    commander.port.send(PayloadKind.JSON, b"{}")
    assert commander.pauses_s()[1] == pytest.approx(1.0)


def test_of_a_stall_only_the_newest_command_is_left_and_keeps_its_own_number_and_time() -> None:
    commander = Commander(Delivery.LATEST)
    commander.sends(1)
    commander.stalls(3)
    assert [(frame.seq, frame.stamp_us) for frame in commander.channel.frames()] == [(1, 50_000), (4, 200_000)]
