"""Holds the settings that a running server was given on its command line."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from mosaic_server.data_dir import default_data_dir
from mosaic_server.entrance.bounds import Bounds
from mosaic_server.entrance.forwarded import ProxyHeader
from mosaic_server.security.passwords import HashingCost
from mosaic_server.security.turn_credentials import MAX_LIFETIME_S
from mosaic_server.sockets.keep_alive import KeepAlivePeriods
from mosaic_server.switchboard.board import AUTHORIZE_WITHIN_S

DASHBOARD_DIR = Path(__file__).parent / "dashboard"
LOOPBACK_HOSTS = frozenset({"localhost", "127.0.0.1", "::1"})


@dataclass(frozen=True, slots=True)
class Settings:
    """The settings of a server. ``allowed_hosts`` are the names in the Host header that are answered; empty
    means any.
    """

    data_dir: Path = field(default_factory=default_data_dir)
    database_url: str | None = None
    allow_signup: bool = False
    allowed_hosts: frozenset[str] = frozenset()
    allowed_origins: frozenset[str] = frozenset()
    trusted_proxies: tuple[str, ...] = ()
    """Addresses and networks of proxies: what they say in ``proxy_header`` counts, and nobody else's."""
    proxy_header: ProxyHeader = ProxyHeader.X_FORWARDED_FOR
    bounds: Bounds = field(default_factory=Bounds)
    uses_tls: bool = False
    dashboard_dir: Path = DASHBOARD_DIR
    serves_widgets: bool = True
    """Modules of widgets that installed plugins ship; False: none of their code reaches a page."""
    keep_alive: KeepAlivePeriods = field(default_factory=KeepAlivePeriods)
    authorize_within_s: float = AUTHORIZE_WITHIN_S
    revocation_check_s: float = 10.0
    """How soon a token or account that another process revoked loses its sockets."""
    audit_days: float = 90.0
    """Older entries of the audit log are dropped."""
    pairs_with: str | None = None
    """The name of the one robot that serves its own network with this server; devices are paired with it by PIN or
    code, and it answers to every address literal in the Host header, which no stranger's DNS can forge."""
    turn_lifetime_s: float = MAX_LIFETIME_S
    """How long TURN credentials made with a shared secret are good for a new relay."""
    hashing: HashingCost = field(default_factory=HashingCost)
    """Of passwords. Lower than the default only where nobody's password is kept: in tests."""
