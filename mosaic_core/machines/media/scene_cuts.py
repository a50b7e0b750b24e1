"""Tells a scene cut from motion, by how much a picture differs from the one before.

An encoder that doesn't know of a cut describes the new scene as motion of the old one, as finely as it described the
last picture: ten to twenty times an ordinary picture. A key frame is made for a size, and is often a third of that.
"""

from __future__ import annotations

LEAST_DIFFERENCE = 18.0
"""Mean difference of luma (0 to 255) between two scenes; two scenes rarely differ less."""
_TIMES_USUAL = 2.5
_MEMORY = 0.2
"""Of the usual difference, given to each new picture."""
_APART_S = 1.0
"""A strobe or a robot that spins gets no key frame with every picture."""


class SceneCuts:
    """Finds the cuts in one source's pictures. ``at_s``: any monotonic clock."""

    def __init__(self) -> None:
        self._usual: float | None = None
        self._cut_at_s = float("-inf")

    def seen(self, difference: float, at_s: float) -> bool:
        """Whether the picture of ``at_s`` begins another scene. ``difference``: of its luma from the one before."""
        usual = difference if self._usual is None else self._usual
        is_other = difference > max(LEAST_DIFFERENCE, _TIMES_USUAL * usual)
        is_cut = is_other and at_s - self._cut_at_s >= _APART_S
        if is_cut:
            self._cut_at_s = at_s
        else:
            self._usual = usual + _MEMORY * (difference - usual)
        return is_cut
