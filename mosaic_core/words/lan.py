"""What a robot and the server that it runs for its own network say to each other, and how that server is found.

A distribution offers such a server by an entry point of the group :data:`GROUP`; the core knows nothing of it but this.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from pydantic import Field

from mosaic_core.words.config import ServerConfig
from mosaic_core.words.wire_model import WireModel

GROUP = "mosaic.lan_server"
SERVICE_TYPE = "_mosaic._tcp.local."
DEFAULT_PORT = 9002
"""Next to the usual port of a server, so that both may run on one machine."""
DEFAULT_ADDRESS = f"0.0.0.0:{DEFAULT_PORT}"


@dataclass(frozen=True, slots=True)
class LanWish:
    """What ``mosaic run --serve`` was told. ``robot_id=None``: the configuration names none, so one is made and kept.

    ``has_screen``: a person reads this terminal, so that PINs may be offered without being asked for."""

    host: str
    port: int
    robot_id: str | None = None
    name: str = ""
    tls_certificate: Path | None = None
    tls_key: Path | None = None
    has_screen: bool = False


@dataclass(frozen=True, slots=True)
class LanChild:
    """How to start the server, and how the robot reaches it once it listens. ``certificate``: the only one to trust."""

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
    """What the entry point names. Both calls block for milliseconds; neither imports a web server."""

    def prepared(self, wish: LanWish) -> LanChild:
        """Make what it needs on disk. Raises :class:`MosaicError` for a wish that can't be fulfilled."""

    def shown(self, news: LanNews, height: int) -> str:
        """What a terminal with so many free lines shows: addresses, PIN and, where it fits, a QR code."""
