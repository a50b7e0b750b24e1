"""What all peers of a robot share: its routes, pictures, loudspeakers, catalogue, identity, and whom to tell."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from mosaic_core.contract.host import Sender
from mosaic_core.machines.control.lease_events import LegacyPeers
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
from mosaic_core.words.ice import IceServer
from mosaic_core.words.signaling import SignalingMessage


class RobotPeer(Protocol):
    """One operator, as the robot sees it from outside."""

    @property
    def peer_id(self) -> str: ...

    @property
    def sender(self) -> Sender: ...

    @property
    def connected_at_s(self) -> float | None: ...

    async def closed(self) -> None:
        """Wait until nothing of it is left."""
        ...


class PeerListener(Protocol):
    """Hears what peers tell their robot, on the event loop."""

    def signal(self, message: SignalingMessage) -> None:
        """Something for the server."""
        ...

    def peer_connected(self, peer: RobotPeer) -> None: ...
    def peer_closed(self, peer: RobotPeer, code: str, message: str) -> None: ...
    def command_refused(self, label: str, sender: Sender, code: str) -> None:
        """A message for a connector was refused before its receiver saw it."""
        ...

    def newest_ice_servers(self) -> Sequence[IceServer]:
        """Those of the youngest peer: their credentials live longest."""
        ...


@dataclass(frozen=True, slots=True)
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
    boot_id: str
    software: str
    listener: PeerListener
