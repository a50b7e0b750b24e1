"""Which pictures of a faster source are shown, so that their mean rate is the wanted one. Pure."""

from __future__ import annotations

SLACK = 0.25
"""Share of a period by which a picture may come early: a 30 fps camera that jitters still gives 30 fps, not 15."""


class PictureThinning:
    """Takes at most ``fps`` pictures per second, on a grid; ``None``: every one."""

    def __init__(self, fps: float | None) -> None:
        self._period_s = 1.0 / fps if fps else 0.0
        self._due_s = float("-inf")

    def takes(self, at_s: float) -> bool:
        """Whether the picture of time ``at_s`` is shown; times rise from call to call."""
        if not self._period_s:
            return True
        if at_s < self._due_s - self._period_s * SLACK:
            return False
        following_s = self._due_s + self._period_s
        # After a gap the grid starts anew instead of letting a burst through.
        self._due_s = following_s if following_s > at_s else at_s + self._period_s
        return True
