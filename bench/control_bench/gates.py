"""What the gates themselves cost: one command through admission, without a network or a thread."""

from __future__ import annotations

from timeit import repeat

from mosaic_core.machines.commands.admission import ArrivedCommand, CommandChannel, refusal_on_arrival
from mosaic_core.machines.control.lease_desk import LeaseDesk
from mosaic_core.machines.control.lease_events import Party, PartyJoined, Requested
from mosaic_core.machines.control.stop_latch import StopLatch
from mosaic_core.machines.timing.pacing import TokenBucket
from mosaic_core.runtime.configuration.receiver_safety import ReceiverSafety

TIMES = 20_000


def arrival_us() -> float:
    """Microseconds of the gates that are asked when a command arrives; the best of five runs."""
    desk = LeaseDesk(["motion"], first_epoch=1)
    desk.handle(PartyJoined(Party("a", "sa", "Anna", is_person=True)), 0.0)
    desk.handle(Requested("a", "motion"), 0.0)
    bucket = TokenBucket(1e9, 1e9)
    channel = CommandChannel(ReceiverSafety(resource="motion"), desk, StopLatch(), max_age_s=0.5, rate=bucket)
    command = ArrivedCommand(channel, "a", "operator", is_ours=True, epoch=1, now_s=0.1)
    refusal = refusal_on_arrival(command)
    assert refusal is None, refusal
    return min(repeat(lambda: refusal_on_arrival(command), number=TIMES, repeat=5)) / TIMES * 1e6
