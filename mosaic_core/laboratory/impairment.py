"""Impairs both directions of a network, whatever travels over it: messages in memory, or real packets."""

from __future__ import annotations

import random

from mosaic_core.machines.laboratory.impaired_link import PROFILES, ImpairedLink, LinkProfile
from mosaic_core.words.errors import guess


class Impairment:
    """Delays and loses what travels :attr:`up` (towards the robot) and :attr:`down`; ``seed`` makes it repeatable."""

    def __init__(self, profile: LinkProfile | str = "pristine", *, seed: int = 1) -> None:
        self.up, self.down = ImpairedLink(_profile(profile)), ImpairedLink(_profile(profile))
        self._chance = random.Random(seed)

    @property
    def is_perfect(self) -> bool:
        return self.up.profile == self.down.profile == PROFILES["pristine"]

    @property
    def is_cut(self) -> bool:
        """Nothing passes, as when the cable is pulled."""
        return self.up.is_cut

    @is_cut.setter
    def is_cut(self, cut: bool) -> None:
        self.up.is_cut = self.down.is_cut = cut

    def become(self, profile: LinkProfile | str) -> None:
        """Another network from now on, both ways."""
        self.up.profile = self.down.profile = _profile(profile)

    def arrival_s(self, link: ImpairedLink, size_bytes: int, now_s: float) -> float | None:
        """When something that leaves now on ``link`` arrives; ``None``: never."""
        chance = self._chance
        return link.arrival_s(size_bytes, now_s, chance.random(), chance.uniform(-1, 1), chance.random())


def _profile(profile: LinkProfile | str) -> LinkProfile:
    if isinstance(profile, LinkProfile):
        return profile
    if profile in PROFILES:
        return PROFILES[profile]
    cure = guess(str(profile), PROFILES, f"there are {', '.join(PROFILES)}, and `LinkProfile(…)` of your own")
    raise ValueError(f"no network has the profile {profile!r}: {cure}")
