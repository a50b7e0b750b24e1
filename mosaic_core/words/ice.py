"""ICE servers: every spelling that people write, normalised once.

Original robot files write ``host:port`` and mean TURN; a scheme is added only where none is present
(UPSTREAM §3.4). What aiortc would drop silently or choke on is an error here, with its cure.
"""

from __future__ import annotations

import re
from typing import Literal

from pydantic import Field, field_validator

from mosaic_core.words.wire_model import WireModel

_URL = re.compile(
    r"^(?P<scheme>stuns?|turns?):(?P<host>\[[0-9a-fA-F:.]+\]|[^:?/\[\]@]+)(?::(?P<port>\d{1,5}))?(?:\?transport=(?P<transport>udp|tcp))?$"
)

IceTransportPolicy = Literal["all", "relay"]
"""As in W3C's ``RTCConfiguration``: which candidates may be used."""


class IceUrl(WireModel):
    """The parts of one ``stun:``/``turn:`` URL (RFC 7064, RFC 7065)."""

    scheme: Literal["stun", "stuns", "turn", "turns"]
    host: str
    port: int = Field(ge=1, le=65535)
    transport: Literal["udp", "tcp"]

    def __str__(self) -> str:
        tail = f"?transport={self.transport}" if self.scheme.startswith("turn") else ""
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"{self.scheme}:{host}:{self.port}{tail}"


def parse_ice_url(text: str) -> IceUrl:
    """Read ``turn:host:port?transport=tcp``, ``stun:[::1]:3478``, ``host:port`` …

    Raises :class:`ValueError`, whose text says what is wrong.
    """
    spelled = text.strip()
    if not re.match(r"^(stuns?|turns?):", spelled):
        if "://" in spelled:
            raise ValueError(f"{text!r} is no ICE URL; write turn:host:port, turns:host:port or stun:host:port")
        spelled = f"turn:{spelled}"
    match = _URL.match(spelled)
    if match is None:
        raise ValueError(f"{text!r} is no ICE URL; write turn:host:port, turns:host:port or stun:host:port")
    secure = match["scheme"].endswith("s")
    if match["scheme"] == "stuns":
        raise ValueError(f"{text!r}: STUN over TLS isn't supported; write stun:")
    if match["scheme"] == "turns" and match["transport"] == "udp":
        raise ValueError(f"{text!r}: TURN over DTLS isn't supported; drop ?transport=udp")
    return IceUrl(
        scheme=match["scheme"],
        host=match["host"].strip("[]"),
        port=int(match["port"] or (5349 if secure else 3478)),
        transport=match["transport"] or ("tcp" if secure else "udp"),
    )


class IceServer(WireModel):
    """One entry of ``ice_servers``; ``urls`` may be written as one string."""

    urls: tuple[str, ...] = Field(description="Where it is, such as turn:turn.example.org:3478; several of one server.")
    username: str | None = Field(default=None, description="For TURN.")
    credential: str | None = Field(default=None, repr=False, description="The password of `username`.")

    @field_validator("urls", mode="before")
    @classmethod
    def _one_is_many(cls, value: object) -> object:
        return (value,) if isinstance(value, str) else value

    @field_validator("urls")
    @classmethod
    def _normalised(cls, urls: tuple[str, ...]) -> tuple[str, ...]:
        return tuple(str(parse_ice_url(url)) for url in urls)

    @property
    def lacks_credentials(self) -> bool:
        """TURN without user name or password: no browser makes any peer connection with such an entry (W3C WebRTC,
        "set a configuration")."""
        return any(url.startswith("turn") for url in self.urls) and not (self.username and self.credential)
