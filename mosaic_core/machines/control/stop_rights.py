"""Decides who may say stop: everybody but an observer from whom a supervisor took that right, until one gives it back.

Never an operator or a supervisor, and never by itself: else a stop that is not heard would be the robot's own doing.
"""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass

from mosaic_core.machines.control.lease_events import Party

MAX_CHANGED = 256
"""Accounts and sessions whose right was changed; whoever lost it first has it again then."""


@dataclass(frozen=True, slots=True)
class RightToStop:
    """Whether somebody may say stop, and the name of the supervisor who changed that last."""

    may_stop: bool = True
    changed_by: str = ""


UNCHANGED = RightToStop()


class StopRights:
    """Decides who may stop one robot. ``key``: the account of a party, so that a new connection gives nothing back."""

    def __init__(self) -> None:
        self._changed: OrderedDict[str, RightToStop] = OrderedDict()

    def right(self, party: Party, key: str) -> RightToStop:
        return self._changed.get(key, UNCHANGED) if party.role == "observer" else UNCHANGED

    def change(self, by: Party, of: Party, key: str, may_stop: bool) -> str | None:
        """``by`` takes the right from ``of``, or gives it back; the code why not."""
        if by.is_original or by.role != "supervisor":
            return "auth.forbidden"
        if of.role != "observer":
            return "safety.always_stops"
        self._changed[key] = RightToStop(may_stop, by.name or by.peer_id)
        self._changed.move_to_end(key)
        if len(self._changed) > MAX_CHANGED:
            self._changed.popitem(last=False)
        return None
