"""What happens to a peer connection on either side of it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class TransportChanged:
    """``connecting``, ``securing``, ``connected``, ``failed`` or ``closed``."""

    state: str


@dataclass(frozen=True, slots=True)
class HelloReceived:
    """The other side knows our control channel."""


@dataclass(frozen=True, slots=True)
class ControlReceived:
    """Any other message on the control channel: a sign of life."""


@dataclass(frozen=True, slots=True)
class Doubted:
    """The network is another one, or the transport hesitates: a word within ``patience_s``, or the other is lost."""

    patience_s: float
