"""Holds what all peers of a robot share: its routes, pictures, loudspeakers, catalogue, identity, and whom to tell."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol

from mosaic_core.contract.host import Sender
from mosaic_core.machines.commands.gates import GateRefusal
from mosaic_core.machines.control.lease_events import LegacyPeers
from mosaic_core.machines.delivery.reassembly import ALL_PARTIALS_BYTES
from mosaic_core.machines.delivery.shared_budget import SharedBudget
from mosaic_core.runtime.commands.link_watch import LinkWatch
from mosaic_core.runtime.control.command_desk import CommandDesk
from mosaic_core.runtime.delivery.outbox import Outbox
from mosaic_core.runtime.delivery.sessions import SessionBook
from mosaic_core.runtime.handlers.routes import Route
from mosaic_core.runtime.media.media_hub import MediaHub
from mosaic_core.runtime.media.talk_hub import TalkHub
from mosaic_core.runtime.observation.delivery_reports import DeliveryReports
from mosaic_core.runtime.peers.near_path import NearPath
from mosaic_core.words.catalogue import Catalogue


class PeerListener(Protocol):
    """Hears what becomes of a robot's operators, on the event loop."""

    def peer_connected(self, sender: Sender) -> None: ...
    def peer_closed(self, sender: Sender, code: str, message: str) -> None:
        """One that was connected is gone."""

    def command_refused(self, label: str, sender: Sender, refusal: GateRefusal) -> None:
        """A message for a connector was refused before its receiver saw it."""


@dataclass(frozen=True, slots=True)
class RouteChange:
    """What a reload does to the routes of a robot, by label. ``renewed``: another handler has taken over the channel;
    of another shape it is ``removed`` and ``added``. ``is_news``: operators see another catalogue."""

    removed: frozenset[str] = frozenset()
    added: frozenset[str] = frozenset()
    renewed: frozenset[str] = frozenset()
    is_news: bool = False


@dataclass(slots=True)
class Site:
    """Holds what one robot is to its peers."""

    routes: dict[str, Route]
    outbox: Outbox
    sessions: SessionBook
    media: MediaHub
    talk: TalkHub
    desk: CommandDesk
    links: LinkWatch
    near: NearPath
    delivery: DeliveryReports
    legacy_peers: LegacyPeers
    catalogue: Catalogue
    """Another one after a reload."""
    boot_id: str
    software: str
    listener: PeerListener
    unfinished: SharedBudget = field(default_factory=lambda: SharedBudget(ALL_PARTIALS_BYTES))
    """Bounds what all peers together have sent in part."""
