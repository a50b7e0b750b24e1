"""Declares what happens to a peer connection on either side of it; to the second one for bulk, too, and what either
side does at its end.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class TransportChanged:
    """The transport has another state: ``connecting``, ``securing``, ``connected``, ``failed`` or ``closed``."""

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


@dataclass(frozen=True, slots=True)
class BulkFailed:
    """Our own transport of this attempt can't be made, or is gone. Without a code the phase names one."""

    attempt: int
    code: str = ""
    message: str = ""


@dataclass(frozen=True, slots=True)
class BulkCloseHeard:
    """The other side says itself that this attempt is over."""

    attempt: int
    code: str


@dataclass(frozen=True, slots=True)
class DropBulk:
    """Close the transport of the attempt, and its channels."""


@dataclass(frozen=True, slots=True)
class TellBulkClosed:
    """Say why there is no second connection, so that bulk takes the other way at once."""

    attempt: int
    code: str
    message: str = ""
