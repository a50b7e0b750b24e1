"""Holds the options of ``mosaic run --serve``; without a model, so that the command's help loads none."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

DEFAULT_PORT = 9002
"""Next to the usual port of a server, so that both may run on one machine."""
DEFAULT_ADDRESS = f"0.0.0.0:{DEFAULT_PORT}"


@dataclass(frozen=True, slots=True)
class LanWish:
    """The options that ``mosaic run --serve`` was given. ``robot_id=None``: the configuration names none, so one is
    made and kept.

    ``has_screen``: a person reads this terminal, so that PINs may be offered without being asked for.
    ``serves_widgets``: pages get the widgets that installed plugins ship."""

    host: str
    port: int
    robot_id: str | None = None
    name: str = ""
    tls_certificate: Path | None = None
    tls_key: Path | None = None
    has_screen: bool = False
    serves_widgets: bool = True
