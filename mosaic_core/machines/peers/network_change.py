"""Decides what a change of this machine's network means for its connections: an address that is gone took its
connections with it, another way out leaves them behind, and a sleep outlasts everybody's patience.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

NetworkChange = Literal["moved", "back"]
"""``moved``: what was connected may hang from now on. ``back``: there may be a way where there was none."""
SLEEP_S = 1.0
"""The clocks with and without sleep part by less than this while a machine is awake."""


@dataclass(frozen=True, slots=True)
class NetworkView:
    """The network at one moment. ``ways_out``: the address from which strangers are reached, for IPv4 and IPv6,
    ``None`` where there is no way; ``slept_s``: how long the machine has slept since it started."""

    addresses: frozenset[str]
    ways_out: tuple[str | None, ...]
    slept_s: float = 0.0


def change_between(before: NetworkView, after: NetworkView) -> NetworkChange | None:
    """``None``: nothing that a connection would notice."""
    if after.slept_s - before.slept_s > SLEEP_S:
        return "moved"
    if before.addresses - after.addresses:
        return "moved"
    changed = [(old, new) for old, new in zip(before.ways_out, after.ways_out, strict=True) if old != new]
    if any(old is not None for old, _ in changed):
        return "moved"
    return "back" if changed or after.addresses != before.addresses else None
