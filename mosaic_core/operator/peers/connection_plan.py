"""Names what a connection to a robot is made from."""

from __future__ import annotations

import time
from collections.abc import Awaitable, Callable, Sequence
from dataclasses import dataclass, field

from mosaic_core.machines.peers.connection_timeline import ConnectionTimeline
from mosaic_core.operator.delivery.data_port import now_us
from mosaic_core.words.catalogue import Catalogue
from mosaic_core.words.ice import IceServer


def _new_timeline() -> ConnectionTimeline:
    return ConnectionTimeline(time.monotonic())


@dataclass(frozen=True, slots=True)
class ConnectionPlan:
    """The ingredients of a connection to one robot. ``catalogue`` is the server's short one, ``described`` what people
    wrote down of a robot that announces none, ``clock_us`` the operator's clock."""

    robot_id: str
    peer_id: str
    session_id: str | None
    catalogue: Catalogue | None
    media_labels: tuple[str, ...]
    ice_servers: tuple[IceServer, ...]
    agreed: dict[str, int]
    is_person: bool = False
    clock_us: Callable[[], int] = now_us
    timeline: ConnectionTimeline = field(default_factory=_new_timeline)
    fresh_ice_servers: Callable[[], Awaitable[Sequence[IceServer]]] | None = None
    uses_bulk_lane: bool = True
    described: Catalogue | None = None
