"""Models what a robot and the server that it runs for its own network say to each other, and how that server is found.

A distribution offers such a server by an entry point of the group :data:`GROUP`; the core knows nothing of it but this.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from pydantic import Field

from mosaic_core.words.config import ServerConfig
from mosaic_core.words.lan_wish import LanWish
from mosaic_core.words.wire_model import WireModel

GROUP = "mosaic.lan_server"
SERVICE_TYPE = "_mosaic._tcp.local."


@dataclass(frozen=True, slots=True)
class LanChild:
    """The command that starts a robot's own server, and the address at which the robot reaches it once it listens.
    ``certificate``: the only one to trust."""

    command: tuple[str, ...]
    server: ServerConfig
    certificate: Path | None = None


class LanNews(WireModel):
    """Server → robot, one line of JSON on its standard output: how things stand, whenever that has changed."""

    urls: tuple[str, ...] = Field(default=(), description="Where a browser on this network finds the page.")
    only_here: bool = Field(default=False, description="Nobody but this machine can open `urls`.")
    hostname: str = Field(default="", description="The name announced over mDNS; empty: not announced.")
    devices: int = Field(default=0, description="Paired ones.")
    page: str = Field(default="", description="Address that pairs whoever opens it, once; empty: none is offered.")
    pin: str = Field(default="", description="What pairs a device when typed there.")
    notice: str = Field(default="", description="What a person at the robot should know; a sentence.")


class LanServer(Protocol):
    """Starts a robot's own server, as the entry point names it. Both calls block for milliseconds; neither imports a
    web server."""

    def prepared(self, wish: LanWish) -> LanChild:
        """Make what it needs on disk. Raises :class:`MosaicError` for a wish that can't be fulfilled."""

    def shown(self, news: LanNews, height: int) -> str:
        """What a terminal with so many free lines shows: addresses, PIN and, where it fits, a QR code."""
