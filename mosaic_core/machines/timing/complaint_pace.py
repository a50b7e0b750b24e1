"""What goes wrong a thousand times a second is worth a line in the log once, and again while it goes on."""

from __future__ import annotations

from collections.abc import Hashable

COMPLAINT_PERIOD_S = 60.0


class ComplaintPace:
    """Whether to say it now. Knows no clock; not thread-safe. Remembers every key that it is asked about."""

    def __init__(self, period_s: float = COMPLAINT_PERIOD_S) -> None:
        self._period_s = period_s
        self._said_at_s: dict[Hashable, float] = {}

    def is_due(self, key: Hashable, now_s: float) -> bool:
        """The first time, and once the period is over since it was due last. ``now_s``: any monotonic clock."""
        said_at_s = self._said_at_s.get(key)
        if said_at_s is not None and now_s - said_at_s < self._period_s:
            return False
        self._said_at_s[key] = now_s
        return True
