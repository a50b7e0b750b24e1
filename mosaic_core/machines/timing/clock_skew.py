"""Measures how far a machine's wall clock is from a server's, by the ``Date`` header of an answer, and what that
breaks."""

from __future__ import annotations

from dataclasses import dataclass

DATE_STEP_S = 1.0
"""``Date`` has whole seconds (RFC 9110 §5.6.7)."""
NOTICEABLE_S = 5.0
TICKET_LIFETIME_S = 300.0
TICKET_LEEWAY_S = 60.0
"""Robots take tickets that are this much from the future or too old by their own clock, and no others."""


@dataclass(frozen=True, slots=True)
class ClockSkew:
    """How far our clock is from the server's. ``ahead_s``: positive if our clock is ahead of the server's; it is wrong
    by ``error_s`` at most.
    """

    ahead_s: float
    error_s: float

    @property
    def is_noticeable(self) -> bool:
        return abs(self.ahead_s) - self.error_s > NOTICEABLE_S

    @property
    def breaks_tickets(self) -> bool:
        """Far enough for tickets to look expired, or not valid yet."""
        limit_s = TICKET_LEEWAY_S if self.ahead_s < 0 else TICKET_LIFETIME_S + TICKET_LEEWAY_S
        return abs(self.ahead_s) - self.error_s > limit_s

    @property
    def sentence(self) -> str:
        if not self.is_noticeable:
            return (
                f"The clocks of this machine and of the server agree (within {abs(self.ahead_s) + self.error_s:.0f} s)."
            )
        way = "ahead of" if self.ahead_s > 0 else "behind"
        return f"This machine's clock is {abs(self.ahead_s):.0f} s {way} the server's."


def clock_skew(asked_at_s: float, answered_at_s: float, server_date_s: float) -> ClockSkew:
    """From our clock before and after, and the server's in between. All in seconds since the epoch."""
    middle_s = (asked_at_s + answered_at_s) / 2
    # the header was cut off to whole seconds: on average the server's clock was half a second later
    ahead_s = middle_s - (server_date_s + DATE_STEP_S / 2)
    return ClockSkew(ahead_s, (answered_at_s - asked_at_s) / 2 + DATE_STEP_S / 2)
