"""Declares what comes back from the receiver of a connection, from which its bit rate is estimated."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from mosaic_core.machines.congestion.path_watch import PathSeen


@dataclass(frozen=True, slots=True)
class ReceiverReport:
    """RTCP receiver report: packets lost and the highest sequence number, both since the beginning, and the round trip
    if this report tells it."""

    packets_lost: int
    highest_sequence: int
    round_trip_s: float | None = None


@dataclass(frozen=True, slots=True)
class BandwidthEstimate:
    """REMB: what the receiver thinks that the path takes, for all that it receives."""

    bitrate_bps: int


@dataclass(frozen=True, slots=True)
class PacketsMissing:
    """NACK: packets asked for again."""

    count: int


@dataclass(frozen=True, slots=True)
class PictureLost:
    """PLI or FIR: the decoder can't go on without a key frame."""


Feedback: TypeAlias = ReceiverReport | BandwidthEstimate | PacketsMissing | PictureLost | PathSeen
"""Whose receiver sends the last kind is better served by ``PathRate``; to ``RateControl`` it says nothing."""
