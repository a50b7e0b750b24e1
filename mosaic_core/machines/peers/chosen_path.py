"""Which way a peer connection takes: the selected candidate pair, in words."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, slots=True)
class ChosenPath:
    """Candidate types are W3C's: ``host``, ``srflx``, ``prflx`` or ``relay``. Addresses (``host:port``,
    ``[host]:port``) are for the user alone."""

    local_type: str
    remote_type: str
    protocol: str
    local_address: str
    remote_address: str

    @property
    def family(self) -> str:
        """``IPv4`` or ``IPv6``."""
        return "IPv6" if self.local_address.startswith("[") else "IPv4"

    def summary(self) -> str:
        """``host → srflx over UDP, IPv4``: without addresses, fit for a log."""
        return f"{self.local_type} → {self.remote_type} over {self.protocol.upper()}, {self.family}"

    def facts(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "local": self.local_type,
            "remote": self.remote_type,
            "protocol": self.protocol,
            "family": self.family,
            "localAddress": self.local_address,
            "remoteAddress": self.remote_address,
        }
