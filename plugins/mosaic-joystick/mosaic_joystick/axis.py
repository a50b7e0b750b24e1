"""One axis of a stick: from the numbers of the kernel to a share of its way. Pure."""

from __future__ import annotations

from dataclasses import dataclass

MOST_FLAT = 0.5
"""Of a driver that says that more of the way is none is not believed."""
REL_FULL = 350
"""How far a 3D mouse tells that it is pushed at most, where the kernel takes its axes for those of a mouse."""
REL_HOLDS_S = 0.1
"""Such a mouse says again and again how far it is pushed, at 60 Hz, and says nothing when it is let go."""


@dataclass(frozen=True, slots=True)
class Axis:
    """An axis as the kernel describes it. ``flat``: so far around its middle it is let go, says its driver."""

    code: int
    name: str
    least: int
    most: int
    flat: int = 0
    is_one_sided: bool = False
    """A trigger, a pedal or a throttle: nought at ``least``."""
    is_relative: bool = False

    def share(self, value: int, dead_zone: float) -> float:
        """-1 to 1; pushed ahead, to the left or up is positive, where the kernel has it the other way round. A trigger
        0 to 1. Behind the dead zone it begins at nought, so that nothing starts with a jerk."""
        if self.is_one_sided:
            return behind(max(0.0, (value - self.least) / (self.most - self.least)), dead_zone)
        half = (self.most - self.least) / 2
        return behind((half + self.least - value) / half, max(dead_zone, min(self.flat / half, MOST_FLAT)))


def behind(share: float, dead_zone: float) -> float:
    """What is left of a share of -1 to 1 behind its dead zone, again -1 to 1. Never ``-0.0``."""
    share = min(1.0, max(-1.0, share))
    if abs(share) <= dead_zone:
        return 0.0
    left = (abs(share) - dead_zone) / (1 - dead_zone)
    return round(left if share > 0 else -left, 4)
