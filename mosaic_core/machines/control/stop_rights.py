"""Who may say stop: everybody but an observer from whom a supervisor took that right, until one gives it back.

Never an operator or a supervisor, and never by itself: else a stop that is not heard would be the robot's own doing.
"""

from __future__ import annotations

from collections import OrderedDict

from mosaic_core.machines.control.lease_events import Party

MAX_TAKEN = 256
"""Accounts and sessions without the right; whoever lost it first has it again then."""


class StopRights:
    """Those of one robot. ``key``: the account of a party, so that a new connection gives nothing back."""

    def __init__(self) -> None:
        self._taken: OrderedDict[str, None] = OrderedDict()

    def may_stop(self, party: Party, key: str) -> bool:
        return party.role != "observer" or key not in self._taken

    def change(self, by: Party, of: Party, key: str, may_stop: bool) -> str | None:
        """``by`` takes the right from ``of``, or gives it back; the code why not."""
        if by.is_original or by.role != "supervisor":
            return "auth.forbidden"
        if of.role != "observer":
            return "safety.always_stops"
        self._taken.pop(key, None)
        if not may_stop:
            self._taken[key] = None
            if len(self._taken) > MAX_TAKEN:
                self._taken.popitem(last=False)
        return None
