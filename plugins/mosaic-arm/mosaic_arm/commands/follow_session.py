"""``mosaic arm follow``: a leader arm beside this machine moves a follower, over the network."""

from __future__ import annotations

import asyncio
import json
from collections import deque
from dataclasses import dataclass, field
from statistics import median
from typing import Any

import typer

from mosaic_arm.commands.following import Following
from mosaic_arm.params import ArmParams
from mosaic_arm.shared_arm import KeptArm
from mosaic_core import DeviceGone
from mosaic_core.cli.operator.operator_send import leased
from mosaic_core.cli.operator.operator_session import connected, until_closed, wrong_way
from mosaic_core.cli.terminal.error_report import FINE
from mosaic_core.messages import JointState, JointTarget
from mosaic_core.operator import MessageInfo, MosaicOperator, RobotConnection, SendableStore
from mosaic_core.words.catalogue import Catalogue
from mosaic_core.words.control import Refusal

LEADER_OPENS_S = 5.0
STALE_S = 0.5
"""A state of the follower that is older says nothing of where it is."""
SHOW_S = 0.5
AGES = 500


@dataclass(slots=True)
class FollowerState:
    """Where the follower is, as it told last."""

    angles_rad: dict[str, float] = field(default_factory=dict)
    at_s: float = float("-inf")
    ages_ms: deque[float] = field(default_factory=lambda: deque(maxlen=AGES))

    def told(self, data: bytes, info: MessageInfo) -> None:
        state = JointState.model_validate_json(data)
        if state.positions:
            self.angles_rad = dict(zip(state.names, state.positions, strict=True))
            self.at_s = asyncio.get_running_loop().time()
        if info.age_s is not None:
            self.ages_ms.append(info.age_s * 1e3)

    def now(self, now_s: float) -> dict[str, float] | None:
        return self.angles_rad if now_s - self.at_s <= STALE_S else None


def state_label(catalogue: Catalogue | None, wanted: str) -> str:
    """The label of the connector that tells where the joints are. Raises :class:`~mosaic_core.words.errors.MosaicError`
    if it is not clear which."""
    if wanted or catalogue is None:
        return wanted
    found = [one.label for one in catalogue.entries if JointState.schema_id in (one.schema_id, one.sent_schema_id)]
    if len(found) == 1:
        return found[0]
    raise wrong_way("--state", f"must name where the joints are; there are: {', '.join(found) or 'none'}")


@dataclass(frozen=True, slots=True)
class FollowSession:
    """Lets a follower arm follow a leader arm; callable as the work of an operator session."""

    robot: str
    label: str
    state: str
    leader: ArmParams
    rate_hz: float
    approach_radps: float
    as_json: bool

    async def __call__(self, operator: MosaicOperator) -> int:
        with KeptArm(self.leader) as leader:
            if not await asyncio.to_thread(leader.wait_open, LEADER_OPENS_S):
                raise leader.gone
            connection = await connected(operator, self.robot)
            store, follower = connection.sendable(self.label), FollowerState()
            states = connection.receivable(state_label(connection.catalogue, self.state))
            ends = states.subscribe(follower.told)
            await store.wait_open()
            try:
                async with leased(connection, self.label):
                    return await until_closed(connection, _Lead(self, leader, connection, store, follower).run())
            finally:
                ends()


class _Lead:
    """Sends the leader's joints until Ctrl+C, the end of the connection, or the loss of the leader's bus."""

    def __init__(
        self, session: FollowSession, leader: KeptArm, connection: RobotConnection, store: SendableStore,
        follower: FollowerState,
    ) -> None:  # fmt: skip
        self._session = session
        self._leader = leader
        self._connection = connection
        self._store = store
        self._follower = follower
        self._following = Following(session.approach_radps)
        self._refusals = 0
        self._last_refusal = ""
        self._sent = 0

    async def run(self) -> int:
        ends = self._connection.on_refusal(self._refused)
        typer.echo("hold the leader arm; Ctrl+C ends, and the follower stands still", err=True)
        try:
            async with asyncio.TaskGroup() as group:
                shows = group.create_task(self._show())
                await self._send()
                shows.cancel()
        except BaseExceptionGroup as group_of:
            raise group_of.exceptions[0] from None
        finally:
            ends()
        return FINE

    def _refused(self, refusal: Refusal) -> None:
        self._refusals += refusal.count or 1
        self._last_refusal = f"{refusal.code}: {refusal.message}" if refusal.message else refusal.code

    async def _send(self) -> None:
        """Raises :class:`DeviceGone` when the leader's bus is lost: the follower's time-out then holds it."""
        loop, period_s = asyncio.get_running_loop(), 1 / self._session.rate_hz
        last_s = next_s = loop.time()
        while True:
            snapshot, now_s = self._leader.snapshot, loop.time()
            if snapshot is None:
                raise DeviceGone(f"the leader: {self._leader.gone.message}", "The follower stands still.")
            target = self._following.target(snapshot.angles_rad, self._follower.now(now_s), now_s - last_s)
            last_s = now_s
            if target:
                message = JointTarget(names=list(target), positions=list(target.values()))
                self._sent += self._store.send_json(message)
            next_s = max(next_s + period_s, loop.time())
            await asyncio.sleep(next_s - loop.time())

    async def _show(self) -> None:
        while True:
            await asyncio.sleep(SHOW_S)
            status = self._status()
            typer.echo(json.dumps(status) if self._session.as_json else status_line(status))

    def _behind_rad(self) -> float | None:
        """How far the farthest joint of the follower is from the leader's."""
        snapshot, there = self._leader.snapshot, self._follower.now(asyncio.get_running_loop().time())
        if snapshot is None or there is None:
            return None
        return max(
            (abs(angle - there[one]) for one, angle in snapshot.angles_rad.items() if one in there), default=None
        )

    def _status(self) -> dict[str, Any]:
        ages = sorted(self._follower.ages_ms)
        behind = self._behind_rad()
        trip_ms = self._connection.round_trip_ms
        return {
            "phase": self._following.phase,
            "sent": self._sent,
            "behind_rad": None if behind is None else round(behind, 3),
            "round_trip_ms": None if trip_ms is None else round(trip_ms, 1),
            "state_age_ms": round(median(ages), 1) if ages else None,
            "state_age_p99_ms": round(ages[int(len(ages) * 0.99)], 1) if ages else None,
            "refusals": self._refusals,
            "last_refusal": self._last_refusal,
        }


def status_line(status: dict[str, Any]) -> str:
    """The same for people."""

    def shown(key: str, unit: str) -> str:
        return "–" if status[key] is None else f"{status[key]:g} {unit}"

    refused = f", {status['refusals']} refused ({status['last_refusal']})" if status["refusals"] else ""
    age = f"{shown('state_age_ms', 'ms')} (p99 {shown('state_age_p99_ms', 'ms')})"
    way = f"behind {shown('behind_rad', 'rad')}, round trip {shown('round_trip_ms', 'ms')}, age of its state {age}"
    return f"{status['phase']}: {way}, {status['sent']} sent{refused}"
