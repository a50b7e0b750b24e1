"""Decides what a follower is told: nothing until it is known where it is, then slowly toward the leader, and once it is
near, whatever the leader does. Pure."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

NEAR_RAD = 0.1
"""The follower has come to the leader."""
FAR_RAD = 0.8
"""The follower was left behind, by a stop or a limit: it comes slowly again instead of leaping. A leader led by hand at
two radians a second is ahead of a follower by half of this."""
MAX_STEP_S = 0.1

FollowPhase = Literal["waiting", "approaching", "following"]


@dataclass(slots=True)
class Following:
    """Makes commands for a follower arm of where the leader stands. ``approach_radps``: how fast each joint comes
    toward the leader at first.
    """

    approach_radps: float
    phase: FollowPhase = "waiting"
    _at: dict[str, float] = field(default_factory=dict)

    def target(
        self, leader: Mapping[str, float], follower: Mapping[str, float] | None, step_s: float
    ) -> dict[str, float] | None:
        """Where the follower shall go now, ``step_s`` after the last time; ``None``: nothing is said. Joints that only
        one of the two has are left out. ``follower``: where it is, ``None`` if that is not known."""
        if follower is None:
            self.phase, self._at = "waiting", {}
            return None
        joints = [name for name in leader if name in follower]
        if self.phase != "following":
            return self._approached(joints, leader, follower, step_s)
        if any(abs(leader[name] - follower[name]) > FAR_RAD for name in joints):
            self.phase, self._at = "approaching", {name: follower[name] for name in joints}
            return dict(self._at)
        return {name: leader[name] for name in joints}

    def _approached(
        self, joints: list[str], leader: Mapping[str, float], follower: Mapping[str, float], step_s: float
    ) -> dict[str, float]:
        if self.phase == "waiting":
            self.phase, self._at = "approaching", {name: follower[name] for name in joints}
        most = self.approach_radps * min(max(0.0, step_s), MAX_STEP_S)
        for name in joints:
            self._at[name] += min(max(leader[name] - self._at[name], -most), most)
        if all(abs(leader[name] - self._at[name]) <= NEAR_RAD >= abs(leader[name] - follower[name]) for name in joints):
            self.phase = "following"
        return dict(self._at)
