"""Models one direction of a bad network: when a packet arrives, or that it never does. Delay, jitter, loss, reordering
and a bottleneck with a finite queue; times and random numbers are arguments.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class LinkProfile:
    """The properties of a bad network, for packets each way."""

    name: str
    """For reports."""
    delay_ms: float = 0.0
    """One way."""
    jitter_ms: float = 0.0
    """The largest deviation from the delay."""
    loss: float = 0.0
    """Share of packets that are lost, 0 to 1."""
    rate_mbps: float | None = None
    """Bottleneck in Mbit/s; ``None``: none."""
    reorder: float = 0.0
    """Share of packets that take no notice of those before them; the others keep their order, as queues do."""
    queue_ms: float = 200.0
    """What the bottleneck buffers before it drops: routers at the edge are often this deep or deeper."""

    def __post_init__(self) -> None:
        for share in ("loss", "reorder"):
            if not 0 <= getattr(self, share) <= 1:
                raise ValueError(f"{share} is a share of the packets, from 0 to 1, not {getattr(self, share)}")
        for time in ("delay_ms", "jitter_ms", "queue_ms"):
            if not getattr(self, time) >= 0:
                raise ValueError(f"{time} is 0 or more, not {getattr(self, time)}")
        if self.rate_mbps is not None and not self.rate_mbps > 0:
            raise ValueError(f"rate_mbps is more than 0, or None for no bottleneck, not {self.rate_mbps}")


PROFILES: dict[str, LinkProfile] = {
    profile.name: profile
    for profile in (
        LinkProfile("pristine"),
        LinkProfile("starlink", delay_ms=30, jitter_ms=10, loss=0.02, rate_mbps=15),
        LinkProfile("4g", delay_ms=50, jitter_ms=15, loss=0.03, rate_mbps=10),
        LinkProfile("wifi-walls", delay_ms=15, jitter_ms=10, loss=0.08, rate_mbps=2),
        LinkProfile("severe", delay_ms=100, jitter_ms=30, loss=0.05, rate_mbps=2),
    )
}
"""Networks that operators really have, as published by those who measured them."""


class ImpairedLink:
    """Delays, loses and reorders the packets of one direction of a network. ``profile`` may be changed at any time;
    what is on its way stays on its way."""

    def __init__(self, profile: LinkProfile) -> None:
        self.profile = profile
        self.is_cut = False
        """Nothing arrives any more, as when the cable is pulled."""
        self.lost = 0
        self.carried_bytes = 0
        """Of what arrives, or is on its way."""
        self._free_at_s = 0.0
        self._last_arrival_s = 0.0

    def arrival_s(self, size_bytes: int, now_s: float, chance: float, deviation: float, reorder: float) -> float | None:
        """When a packet that leaves ``now_s`` arrives; ``None``: lost.

        ``chance`` and ``reorder`` are uniform in [0, 1), ``deviation`` in [-1, 1].
        """
        profile = self.profile
        if self.is_cut or chance < profile.loss:
            self.lost += 1
            return None
        sent_s = now_s
        if profile.rate_mbps is not None:
            start_s = max(now_s, self._free_at_s)
            if start_s - now_s > profile.queue_ms / 1e3:
                self.lost += 1
                return None
            sent_s = self._free_at_s = start_s + size_bytes * 8 / (profile.rate_mbps * 1e6)
        arrival_s = sent_s + max(0.0, profile.delay_ms + deviation * profile.jitter_ms) / 1e3
        if reorder >= profile.reorder:
            arrival_s = max(arrival_s, self._last_arrival_s)
            self._last_arrival_s = arrival_s
        self.carried_bytes += size_bytes
        return arrival_s
