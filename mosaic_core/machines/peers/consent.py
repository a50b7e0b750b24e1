"""Whether the other side of an ICE connection is still there and agrees to be sent to (RFC 7675): asks it now and then,
often while it is silent, and calls it lost after a bounded silence.

Anything that arrives is a sign of life: pictures' reports, data, its own checks. A live peer that says nothing still
answers when asked; one that is gone, page killed or network away, does neither.
"""

from __future__ import annotations

from typing import Literal

LOST_AFTER_S = 14.0
"""Of silence. A network that stalls for ten seconds, at a change of Wi-Fi say, costs nothing, though the last word may
have come three seconds before: an original operator can't resume."""
CONSENT_S = 30.0
"""Without an answer consent ends, whatever else arrives (RFC 7675 §5.1)."""
ASK_PERIOD_S = 5.0
"""While it is heard (RFC 7675 §5.1)."""
DOUBT_AFTER_S = 2.0
"""Of silence; from then on it is asked at every tick, so that ten questions must be lost, not two.

A peer that lives and says nothing is asked every three seconds; browsers ask every 2.5."""
TICK_S = 1.0
"""How often to look, varied by a fifth either way so that many connections do not ask in step."""
STALL_S = 0.5
"""A tick that comes this late means that our own process stood still; what was sent to it may wait unread."""
_GRACE_S = 3 * TICK_S

ConsentStep = Literal["wait", "ask", "lost"]


class Consent:
    """Asks the other side of one connection for its consent. ``now_s`` is any monotonic clock."""

    def __init__(self, now_s: float) -> None:
        self._heard_at_s = self._answered_at_s = self._asked_at_s = now_s
        self._tick_due_at_s = now_s
        self._spared_until_s = now_s

    def heard(self, now_s: float) -> None:
        """Something has come from the other side."""
        self._heard_at_s = now_s

    def answered(self, now_s: float) -> None:
        """It has answered a question: it is the one that we agreed with, and it agrees still."""
        self._heard_at_s = self._answered_at_s = now_s

    def pause_s(self, now_s: float, random_unit: float) -> float:
        """Until the next :meth:`tick`. ``random_unit``: a random number of [0, 1)."""
        pause_s = TICK_S * (0.8 + 0.4 * random_unit)
        self._tick_due_at_s = now_s + pause_s
        return pause_s

    def tick(self, now_s: float) -> ConsentStep:
        """What to do now."""
        if now_s > self._tick_due_at_s + STALL_S:
            self._spared_until_s = now_s + _GRACE_S
        silent_s = now_s - self._heard_at_s
        is_over = silent_s >= LOST_AFTER_S or now_s - self._answered_at_s >= CONSENT_S
        if is_over and now_s >= self._spared_until_s:
            return "lost"
        if silent_s >= DOUBT_AFTER_S or now_s - self._asked_at_s >= ASK_PERIOD_S:
            self._asked_at_s = now_s
            return "ask"
        return "wait"
