"""The lease of one resource: who holds it, until when, by which epoch, and whose commands may therefore act."""

from __future__ import annotations

from dataclasses import dataclass, field

from mosaic_core.machines.control.lease_events import Party
from mosaic_core.machines.control.lease_queue import LeaseQueue


@dataclass(slots=True)
class ResourceLease:
    """The lease of one resource, held or free. ``epoch`` and ``alive_s``, the holder's last sign of life, mean
    something only while there is a ``holder``.
    """

    resource: str
    expiry_s: float
    holder: Party | None = None
    epoch: int = 0
    alive_s: float = 0.0
    queue: LeaseQueue = field(default_factory=LeaseQueue)

    @property
    def ends_at_s(self) -> float | None:
        """When it expires unless it is kept; ``None``: nobody holds it."""
        return None if self.holder is None else self.alive_s + self.expiry_s

    def is_held_by(self, peer_id: str) -> bool:
        return self.holder is not None and self.holder.peer_id == peer_id

    def has_expired(self, now_s: float) -> bool:
        return self.holder is not None and now_s >= self.alive_s + self.expiry_s

    def keep(self, now_s: float) -> None:
        """A sign of life of the holder. A clock that goes back takes nothing."""
        self.alive_s = max(self.alive_s, now_s)

    def refusal(self, party: Party, epoch: int | None, now_s: float) -> str | None:
        """Why a command of ``party``, whose role may command, may not act now."""
        is_holder, is_over = self.is_held_by(party.peer_id), self.has_expired(now_s)
        if is_holder and is_over:
            return "lease.expired"
        if self.holder is not None and not is_over and not is_holder:
            return "lease.not_holder"
        if party.is_original:
            return None if is_holder or not self.queue else "lease.required"
        if is_holder and epoch == self.epoch:
            return None
        return "lease.old_epoch" if epoch else "lease.required"
