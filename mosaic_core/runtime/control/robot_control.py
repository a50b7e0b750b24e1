"""Puts together what decides who commands one robot: fence, desk, links, reports and journal."""

from __future__ import annotations

import asyncio
import random
import time
from collections.abc import Mapping

from mosaic_core.contract.host import Sender
from mosaic_core.machines.control.lease_desk import LeaseDesk
from mosaic_core.machines.control.stop_latch import StopLatch
from mosaic_core.runtime.commands.fence import Fence
from mosaic_core.runtime.commands.link_watch import LinkWatch
from mosaic_core.runtime.commands.safety_watchdog import SafetyWatchdog
from mosaic_core.runtime.control.command_desk import CommandDesk, DeskListener
from mosaic_core.runtime.control.journal import JournalFile, RobotJournal, name_of
from mosaic_core.runtime.control.link_reports import LinkReports
from mosaic_core.runtime.handlers.receiver import Outcome
from mosaic_core.runtime.handlers.routes import Route
from mosaic_core.runtime.observation.counters import LeaseSnapshot, StopSnapshot
from mosaic_core.words.config import ControlConfig

MOTION = "motion"
"""The resource that every robot has."""


class RobotControl:
    """Puts together what decides on commands to one robot. Made on the event loop when it starts; event loop only."""

    def __init__(
        self,
        config: ControlConfig,
        routes: Mapping[str, Route],
        safety: SafetyWatchdog,
        links: LinkWatch,
        listener: DeskListener,
    ) -> None:
        self._file = JournalFile(config.journal_file) if config.journal_file is not None else None
        self.journal = RobotJournal(self._file.write) if self._file is not None else RobotJournal()
        self._routes = routes
        self.links = links
        self.desk = CommandDesk(self.journal, listener)
        self._fence = _fence(config, routes, safety, self.desk)
        self.desk.attach(self._fence)
        self._reports = LinkReports(links, routes.values, self._commander, self.desk)

    def connectors_changed(self) -> None:
        """There are other routes than before: perhaps with leases that are new."""
        named = (route.safety.resource for route in self._routes.values())
        for resource in self._fence.add_resources(name for name in named if name is not None):
            self.desk.tell_lease(resource)

    def _commander(self, route: Route) -> str | None:
        if route.safety.resource is not None:
            return self.desk.holder_id(route.safety.resource)
        return route.receiver.watch.mover if route.receiver is not None else None

    async def close(self) -> None:
        self._reports.close()
        self.journal.flush(float("inf"))
        if self._file is not None:
            await asyncio.to_thread(self._file.close)

    # -- for the journal -----------------------------------------------------------------------------------------

    def peer_connected(self, sender: Sender) -> None:
        self.journal.note("peer.connected", who=name_of(sender), account=sender.operator_id)

    def peer_closed(self, sender: Sender, code: str, message: str) -> None:
        who, account = name_of(sender), sender.operator_id
        self.journal.note("peer.closed", who=who, account=account, code=code, message=message)

    def command_done(self, outcome: Outcome) -> None:
        item = outcome.item
        if outcome.refusal is not None:
            self.journal.refused(item.channel, item.sender, outcome.refusal)
        elif self._routes[item.channel].safety.is_motion:  # what moves nothing would fill the journal by itself
            self.journal.accepted(item.channel, item.sender)

    # -- for the live table --------------------------------------------------------------------------------------

    @property
    def limit_factors(self) -> Mapping[str, float]:
        """What is left of the speed, by label, where somebody commands."""
        return self._reports.factors

    def leases(self) -> tuple[LeaseSnapshot, ...]:
        with self._fence.lock:
            desk = self._fence.desk
            return tuple(
                LeaseSnapshot(
                    resource=resource,
                    epoch=desk.epoch(resource),
                    holder_id=holder.peer_id if holder else None,
                    holder=(holder.name or holder.peer_id) if holder else "",
                    is_person=holder is not None and holder.is_person,
                    waiting=tuple(one.party.name or one.party.peer_id for one in desk.queue(resource)),
                )
                for resource in desk.resources
                for holder in (desk.holder(resource),)
            )

    def stop_snapshot(self) -> StopSnapshot | None:
        with self._fence.lock:
            latch = self._fence.latch
            if not latch.is_stopped or latch.since_s is None:
                return None
            return StopSnapshot(by=latch.by, reason=latch.reason, for_s=time.monotonic() - latch.since_s)


def _fence(config: ControlConfig, routes: Mapping[str, Route], safety: SafetyWatchdog, desk: CommandDesk) -> Fence:
    """Around all receivers. Epochs begin anywhere: none of before a restart fits a lease of after it."""
    named = (route.safety.resource for route in routes.values())
    resources = dict.fromkeys([MOTION, *sorted(name for name in named if name is not None)])
    leases = LeaseDesk(
        resources, expiry_s=config.lease_expiry_s, first_epoch=random.getrandbits(32), legacy=config.legacy_peers
    )
    return Fence(safety, leases, StopLatch(), desk.pass_on)
