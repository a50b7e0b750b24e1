"""Whether a certificate ends soon enough to say so."""

from __future__ import annotations

WARN_DAYS = 14.0
"""Public authorities renew 30 days before the end; two weeks later something is broken."""


def days_left(not_after_s: float, now_s: float) -> float:
    """Days until the end; negative after it. Seconds since the epoch."""
    return (not_after_s - now_s) / 86400


def ends_soon(days: float) -> bool:
    return days < WARN_DAYS
