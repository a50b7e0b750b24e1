"""Why a demo could not start or ended: one exception, always with what to do about it."""

from __future__ import annotations


class DemoFailed(Exception):
    """Ends the demo with exit code 1. ``details`` are log lines of the child that failed."""

    def __init__(self, message: str, cure: str = "", details: str = "") -> None:
        super().__init__(message)
        self.message = message
        self.cure = cure
        self.details = details
