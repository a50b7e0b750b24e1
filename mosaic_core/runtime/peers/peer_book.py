"""The peers of one robot: starts them, tells its listener of them, and remembers each until nothing of it is left."""

from __future__ import annotations

import logging
import time
from collections.abc import Iterator, Sequence

from mosaic_core.contract.host import Sender
from mosaic_core.runtime.observation.counters import PeerSnapshot
from mosaic_core.runtime.peers.peer import Peer
from mosaic_core.runtime.peers.site import RouteChange, Site
from mosaic_core.runtime.signaling.server_link import Introduction
from mosaic_core.runtime.timing.background_tasks import BackgroundTasks
from mosaic_core.runtime.transport.transport import AnswererFactory
from mosaic_core.words.ice import IceServer

logger = logging.getLogger(__name__)


class PeerBook:
    """Holds every peer of a robot under its id; implements ``PeerKeeper`` and ``PeerStarter``. Event loop only."""

    def __init__(self, site: Site, make_answerer: AnswererFactory) -> None:
        self._site = site
        self._make_answerer = make_answerer
        self._peers: dict[str, Peer] = {}
        self._endings = BackgroundTasks()
        self._newest_ice_servers: Sequence[IceServer] = ()

    def __iter__(self) -> Iterator[Peer]:
        return iter(tuple(self._peers.values()))

    def get(self, peer_id: str) -> Peer | None:
        return self._peers.get(peer_id)

    def connected(self) -> tuple[Sender, ...]:
        """The operators whose peer connection is up."""
        return tuple(peer.sender for peer in self if peer.connected_at_s is not None)

    def start_peer(self, introduction: Introduction) -> Peer:
        peer = Peer(introduction, self._site, self, self._make_answerer)
        self._peers[peer.peer_id] = peer
        self._newest_ice_servers = introduction.start.ice_servers
        peer.begin()
        return peer

    def connectors_changed(self, change: RouteChange) -> None:
        for peer in self:
            peer.connectors_changed(change)

    def close_all(self, code: str) -> None:
        for peer in self:
            peer.close(code)

    async def closed(self) -> None:
        """Until nothing is left of those that have ended; cancelled, it leaves them alone."""
        try:
            await self._endings.done()
        finally:
            self._endings.cancel()

    # -- what peers tell -----------------------------------------------------------------------------------------

    def newest_ice_servers(self) -> Sequence[IceServer]:
        return self._newest_ice_servers

    def peer_connected(self, peer: Peer) -> None:
        logger.info("operator %s connected", peer.operator.name, extra={"peerId": peer.peer_id})
        for other in self:
            if other is not peer and other.sender.session_id == peer.sender.session_id:
                other.close("peer.replaced")
        self._site.listener.peer_connected(peer.sender)

    def peer_closed(self, peer: Peer, code: str, message: str) -> None:
        if self._peers.get(peer.peer_id) is peer:
            del self._peers[peer.peer_id]
        self._endings.start(peer.closed())
        fields = {"peerId": peer.peer_id, "code": code}
        logger.info("operator %s left (%s)", peer.operator.name, code, extra=fields)
        if peer.connected_at_s is not None:
            self._site.listener.peer_closed(peer.sender, code, message)

    # -- the live table ------------------------------------------------------------------------------------------

    def snapshot(self) -> tuple[PeerSnapshot, ...]:
        now_s = time.monotonic()
        return tuple(self._row(peer, now_s) for peer in self)

    def _row(self, peer: Peer, now_s: float) -> PeerSnapshot:
        sender = peer.sender
        return PeerSnapshot(
            peer_id=sender.peer_id,
            session_id=sender.session_id,
            operator_id=sender.operator_id,
            name=sender.name,
            role=sender.role,
            phase=peer.phase,
            connected_s=None if peer.connected_at_s is None else now_s - peer.connected_at_s,
            channels=peer.channels,
            watches=self._site.media.watched_by(sender.peer_id),
            is_person=sender.is_person,
            is_original=sender.is_original,
        )
