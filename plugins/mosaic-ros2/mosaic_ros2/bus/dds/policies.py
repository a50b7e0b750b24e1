"""Translates quality of service between ROS' words and Cyclone DDS' policies."""

from __future__ import annotations

from cyclonedds.core import Policy, Qos
from cyclonedds.util import duration

from mosaic_ros2.bus.qos import QosProfile

WRITE_BLOCKS_S = 0.02
"""Longest wait of a reliable writer for readers who are behind."""
_NANOSECONDS = 1e9
_ENDLESS_S = 1e8
"""Longer than any promise: DDS says infinite by the largest number that it has."""


def policies_of(profile: QosProfile, *, is_writer: bool) -> Qos:
    """The policies of a writer or reader. It writes plain CDR as ROS does; it reads XCDR2's plain form too."""
    reliability = (
        Policy.Reliability.Reliable(duration(seconds=WRITE_BLOCKS_S))
        if profile.is_reliable
        else Policy.Reliability.BestEffort
    )
    policies = [
        reliability,
        Policy.Durability.TransientLocal if profile.is_latched else Policy.Durability.Volatile,
        Policy.History.KeepLast(max(1, profile.depth)),
        Policy.DataRepresentation(use_cdrv0_representation=True, use_xcdrv2_representation=not is_writer),
    ]
    if not is_writer:
        # What this robot publishes itself goes to others: a topic that is read and bridged would go round for ever.
        policies.append(Policy.IgnoreLocal.Participant)
    if profile.is_latched and is_writer:
        depth = max(1, profile.depth)
        policies.append(Policy.DurabilityService(0, Policy.History.KeepLast(depth), -1, -1, -1))
    if profile.deadline_s:
        policies.append(Policy.Deadline(duration(seconds=profile.deadline_s)))
    if profile.lease_s:
        policies.append(Policy.Liveliness.Automatic(duration(seconds=profile.lease_s)))
    return Qos(*policies)


def profile_of(qos: Qos) -> QosProfile:
    """What an endpoint told of itself. How much it keeps is not told over the network."""
    history = qos[Policy.History]
    deadline, liveliness = qos[Policy.Deadline], qos[Policy.Liveliness]
    return QosProfile(
        is_reliable=isinstance(qos[Policy.Reliability], Policy.Reliability.Reliable),
        is_latched=qos[Policy.Durability] in (Policy.Durability.TransientLocal, Policy.Durability.Transient),
        depth=history.depth if isinstance(history, Policy.History.KeepLast) else 10,
        deadline_s=_seconds(deadline.deadline) if deadline is not None else 0.0,
        lease_s=_seconds(liveliness.lease_duration) if liveliness is not None else 0.0,
    )


def _seconds(nanoseconds: int) -> float:
    seconds = nanoseconds / _NANOSECONDS
    return seconds if seconds < _ENDLESS_S else 0.0
