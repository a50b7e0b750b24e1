"""Quality of service: what a publisher offers, what a subscription asks for, and whether the two fit. Pure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias

QosChoice: TypeAlias = Literal["auto", "sensor", "reliable", "latched"]


@dataclass(frozen=True, slots=True)
class QosProfile:
    """The policies that decide whether ROS nodes hear each other. ``depth``: messages that wait at most.

    ``is_latched``: transient local, whoever comes late gets the last ones. ``deadline_s``, ``lease_s``: the longest
    pause between two messages, and between two signs of life, 0: none is promised or asked for.
    """

    is_reliable: bool = True
    is_latched: bool = False
    depth: int = 10
    deadline_s: float = 0.0
    lease_s: float = 0.0

    def __str__(self) -> str:
        words = [
            "reliable" if self.is_reliable else "best effort",
            "transient local" if self.is_latched else "volatile",
        ]
        words += [
            f"{name} {value:g} s" for name, value in (("deadline", self.deadline_s), ("lease", self.lease_s)) if value
        ]
        return ", ".join(words)


SENSOR = QosProfile(is_reliable=False, depth=5)
RELIABLE = QosProfile()
LATCHED = QosProfile(is_latched=True, depth=1)
PROFILES: dict[str, QosProfile] = {"sensor": SENSOR, "reliable": RELIABLE, "latched": LATCHED}


def misfits(offered: QosProfile, asked: QosProfile) -> list[str]:
    """What a publisher offers too little of for this subscription; none: they hear each other."""
    found = []
    if asked.is_reliable and not offered.is_reliable:
        found.append("it is best effort, and reliable is asked for")
    if asked.is_latched and not offered.is_latched:
        found.append("it is volatile, and transient local is asked for")
    if asked.deadline_s and not 0 < offered.deadline_s <= asked.deadline_s:
        found.append(f"its deadline is not within the {asked.deadline_s:g} s that are asked for")
    if asked.lease_s and not 0 < offered.lease_s <= asked.lease_s:
        found.append(f"its liveliness is not told within the {asked.lease_s:g} s that are asked for")
    return found


def fitting(offers: Sequence[QosProfile], depth: int = 0) -> QosProfile:
    """The most that can be asked of all these publishers: reliable and transient local where every one of them is."""
    is_latched = bool(offers) and all(one.is_latched for one in offers)
    is_reliable = bool(offers) and all(one.is_reliable for one in offers)
    usual = max((one.depth for one in offers), default=1) if is_latched else (10 if is_reliable else 5)
    return QosProfile(is_reliable, is_latched, min(depth or usual, 1000))
