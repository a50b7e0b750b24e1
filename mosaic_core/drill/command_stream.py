"""Sends one operator's commands to one receiver, frame by frame: honest ones at a steady rate, and any other."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from mosaic_core.drill.commands import DrillCommand
from mosaic_core.drill.findings import ExerciseFailed, NothingMoved
from mosaic_core.drill.recorder import Act, is_refusal
from mosaic_core.drill.rig import DrilledReceiver, DrillOperator, Rig, comes_true
from mosaic_core.machines.delivery.framing import SEQ_MODULUS, Frame, encode_frame
from mosaic_core.words.control import CHANNEL_PROTOCOL
from mosaic_core.words.data_type import Delivery
from mosaic_core.words.errors import ConnectionFailed

PERIOD_S = 0.05
"""Twenty commands a second, as a dashboard sends them."""
BEGIN_S = 3.0
"""For the first command to be carried out; a device that is opened late has its own time."""
GRACE_S = 1.0
"""How much later than it must a lease may end on a busy machine; how late it was is an exercise of its own."""


class CommandStream:
    """Opened on the operator's link; :meth:`say` says anything."""

    def __init__(self, rig: Rig, who: DrillOperator, subject: DrilledReceiver, command: DrillCommand) -> None:
        is_latest = subject.delivery is Delivery.LATEST
        self._rig = rig
        self.who = who
        self.subject = subject
        self.command = command
        self.seq = 0
        self.said_at_s = 0.0
        self._channel = who.link.create_channel(
            subject.label,
            protocol=CHANNEL_PROTOCOL,
            ordered=not is_latest,
            max_retransmits=0 if is_latest else None,
        )

    @property
    def epoch(self) -> int:
        """What this operator holds now."""
        resource = self.subject.safety.resource
        return 0 if resource is None else int(self.who.control.epoch_of(resource))

    @property
    def period_s(self) -> float:
        safety = self.subject.safety
        period_s = PERIOD_S if safety.timeout_s is None else min(PERIOD_S, safety.timeout_s / 3)
        return period_s if safety.max_rate_hz is None else max(period_s, 1.2 / safety.max_rate_hz)

    def say(self, payload: bytes | None = None, *, seq: int | None = None, epoch: int | None = None) -> None:
        """Send one frame; what is not said is as it should be."""
        if seq is None:
            seq = self.seq = (self.seq + 1) % SEQ_MODULUS
        frame = Frame(
            self.command.kind,
            self.command.payload() if payload is None else payload,
            seq=seq,
            epoch=self.epoch if epoch is None else epoch,
            stamp_us=time.monotonic_ns() // 1000,
        )
        self.said_at_s = time.monotonic()
        try:
            for part in encode_frame(frame):
                self._channel.send(part)
        except ConnectionFailed:
            raise ExerciseFailed("the robot closed the channel") from None

    async def open(self) -> None:
        if not await comes_true(lambda: self._channel.is_open, BEGIN_S):
            raise ExerciseFailed("its data channel did not open")

    async def drive(self, for_s: float) -> None:
        """Honest commands at a steady rate."""
        ends_at_s = time.monotonic() + for_s
        while time.monotonic() < ends_at_s:
            self.say()
            await asyncio.sleep(self.period_s)

    async def until_moving(self) -> None:
        """Drive until the receiver has carried a command out; raises :class:`ExerciseFailed` if it does not."""
        began_s = time.monotonic()
        while not any(self.moves(act) for act in self.subject.recorder.commands_since(began_s)):
            if time.monotonic() - began_s > BEGIN_S:
                raise self._nothing_moved(began_s)
            await self.hold()
            await self._let_go()
            await self.drive(self.period_s)

    async def _let_go(self) -> None:
        """Pause, where that is asked for: a device that was opened after the first command came back, as it were."""
        if "safety.release_first" in self.who.refusals[-1:]:
            timeout_s = self.subject.safety.timeout_s
            await asyncio.sleep(GRACE_S if timeout_s is None else 1.1 * timeout_s)

    async def hold(self) -> None:
        """Have the lease, where there is one to have: take it, also again where a machine that stood still for two
        seconds let it expire before anything moved."""
        resource = self.subject.safety.resource
        if resource is not None and self.epoch == 0:
            # Where the robot lost a commander before, whose lease lingers, this one is next.
            await self.who.control.take(resource, wait_s=self._rig.lease_expiry_s + GRACE_S)

    def moves(self, act: Act) -> bool:
        """Whether a command that was carried out means motion; one that names a position does."""
        if self.command.positions or not self.command.fields:
            return True
        return any(self.command.at(act.value, field) for field in self.command.fields)

    def _nothing_moved(self, since_s: float) -> NothingMoved:
        broken = [act.cause for act in self.subject.recorder.acts if act.kind == "failed" and act.at_s >= since_s]
        codes = [*dict.fromkeys(self.who.refusals), *dict.fromkeys(broken)]
        why = f" ({', '.join(codes)})" if codes else ": handle_data does not return"
        is_refused = bool(broken) and all(map(is_refusal, broken))
        return NothingMoved(f"no command was carried out within {BEGIN_S:.0f} s{why}", is_refused=is_refused)


async def placed(subject: DrilledReceiver) -> DrillCommand:
    """Its command, which tells it to be where it is. Raises what :meth:`PositionReports.known` raises."""
    assert subject.command is not None
    places = await subject.reports.known(subject.command.positions) if subject.command.positions else {}
    return subject.command.placed(places.get)


@asynccontextmanager
async def opened(
    rig: Rig, subject: DrilledReceiver, role: str = "operator", *, holds: bool = True
) -> AsyncIterator[CommandStream]:
    """Somebody connects, takes the lease if there is one to take, and may command; gone afterwards."""
    who = await rig.operator(role)
    try:
        stream = CommandStream(rig, who, subject, await placed(subject))
        if holds:
            await stream.hold()
        await stream.open()
        yield stream
    finally:
        await rig.dismiss(who)


@asynccontextmanager
async def moving(rig: Rig, subject: DrilledReceiver) -> AsyncIterator[CommandStream]:
    """Somebody who commands, and has got it to move."""
    async with opened(rig, subject) as stream:
        await stream.until_moving()
        yield stream


@asynccontextmanager
async def in_background(stream: CommandStream) -> AsyncIterator[None]:
    """The operator goes on commanding meanwhile, whatever happens."""

    async def drive() -> None:
        while True:
            await stream.drive(60.0)

    driving = asyncio.create_task(drive())
    try:
        yield
    finally:
        driving.cancel()
        await asyncio.gather(driving, return_exceptions=True)
