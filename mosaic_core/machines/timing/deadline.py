"""The event that every machine with a deadline takes."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class DeadlinePassed:
    """The time of the machine's ``deadline_s`` has come."""
