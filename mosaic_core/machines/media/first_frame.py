"""Why a camera that is watched shows nothing, from what has arrived of it. The dashboard decides by the same table."""

from __future__ import annotations

from dataclasses import dataclass

FIRST_FRAME_TIMEOUT_S = 8.0
"""A camera may warm up for seconds; after this somebody who looks at nothing wants to know why."""


@dataclass(frozen=True, slots=True)
class ReceivedSoFar:
    """The counts of what one track has received: ``packets`` that came, ``frames`` that were decoded, and how many
    packets the sender reports to have sent (RTCP sender reports; ``None``: it has sent no report).
    """

    packets: int
    frames: int
    reported_packets: int | None


def first_frame_code(received: ReceivedSoFar | None) -> str:
    """The reason code; empty where pictures were decoded after all. ``None``: nothing can be measured."""
    if received is None:
        return "media.no_first_frame"
    if received.frames:
        return ""
    if received.packets:
        return "media.not_decoded"
    # Reports are small and go the same way: who tells of packets that never came has lost them on the way.
    return "media.no_packets" if received.reported_packets else "media.not_sent"
