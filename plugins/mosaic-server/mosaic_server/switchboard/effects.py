"""Declares what the switchboard wants done, in this order."""

from __future__ import annotations

from dataclasses import dataclass

from mosaic_core.words.catalogue import Catalogue
from mosaic_core.words.codes import CLOSE_REASONS, CloseCode, ResultCode
from mosaic_core.words.signaling import SignalingMessage


@dataclass(frozen=True, slots=True)
class SendToLink:
    socket: int
    message: SignalingMessage


@dataclass(frozen=True, slots=True)
class CloseLink:
    """Close the socket; the switchboard has already forgotten it."""

    socket: int
    code: CloseCode

    @property
    def reason(self) -> str:
        return CLOSE_REASONS[self.code]


@dataclass(frozen=True, slots=True)
class LimitFrames:
    """Take frames of up to this many bytes from the socket from now on."""

    socket: int
    size_bytes: int


@dataclass(frozen=True, slots=True)
class KeepCatalogue:
    """Write the robot's short catalogue to the database."""

    robot_id: str
    catalogue: Catalogue


@dataclass(frozen=True, slots=True)
class ConnectionsMade:
    """Answer to :class:`~mosaic_server.switchboard.events.ConnectionsRequested`: all of them exist now."""


@dataclass(frozen=True, slots=True)
class ConnectionsRefused:
    """Answer to :class:`~mosaic_server.switchboard.events.ConnectionsRequested`: none was made."""

    code: ResultCode
    robot_id: str | None = None
    reason: str | None = None
    """Our reason code, where the number says too little."""


Effect = SendToLink | CloseLink | LimitFrames | KeepCatalogue | ConnectionsMade | ConnectionsRefused
