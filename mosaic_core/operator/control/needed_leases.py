"""Tells which leases the connectors of a robot need, who holds them, and the call that takes one."""

from __future__ import annotations

from collections.abc import Mapping

from mosaic_core.machines.control.operator_control import LeaseView
from mosaic_core.operator.control.lease import LeaseDenied
from mosaic_core.operator.stores.channel_plan import found_entry, resource_of
from mosaic_core.words.catalogue import Catalogue
from mosaic_core.words.errors import guess, whole_sentence

MOTION = "motion"
_FREED_BY_TAKING = ("lease.required", "lease.not_holder", "lease.old_epoch", "lease.expired")
"""Refusals of a message that whoever holds the lease would not get."""


class NeededLeases:
    """The leases that commands of one robot need, as its ``catalogue`` has them; nothing before it is known."""

    def __init__(self, catalogue: Catalogue | None = None) -> None:
        self._catalogue = catalogue
        entries = catalogue.entries if catalogue is not None else ()
        self.names = tuple(dict.fromkeys(name for entry in entries if (name := resource_of(entry)) is not None))

    @property
    def usual(self) -> str:
        """What is meant where none is named: ``motion``, unless all connectors that need a lease need another one."""
        return self.names[0] if len(self.names) == 1 else MOTION

    def asked_for(self, resource: str | None) -> str:
        """The lease to take. Raises :class:`LeaseDenied` where none is named and several others are meant."""
        if resource is None and len(self.names) > 1 and MOTION not in self.names:
            message = f"No connector of this robot needs the lease '{MOTION}'. Needed are: {', '.join(self.names)}."
            raise LeaseDenied(MOTION, "lease.unknown_resource", message, cure=f"Name one: {_call(self.names[0])}.")
        return resource or self.usual

    def denied(self, denied: LeaseDenied, views: Mapping[str, LeaseView]) -> LeaseDenied:
        """The same with the name of the lease and of its holder, or with the leases that there are."""
        message = f"The lease '{denied.resource}': {whole_sentence(denied.message)}{_held(denied.resource, views)}"
        cure = denied.cure
        if denied.code == "lease.unknown_resource":
            known = [name for name in dict.fromkeys((*self.names, *views)) if name != denied.resource]
            meant = guess(denied.resource, known)
            cure = f"{meant} There are: {', '.join(known)}.".strip() if known else cure
        return LeaseDenied(denied.resource, denied.code, message, cure=cure)

    def refused(self, label: str, code: str, views: Mapping[str, LeaseView]) -> str:
        """Why a message to ``label`` was refused, if a lease is the reason: which one, who holds it, and the call that
        takes it; empty for any other."""
        entry = found_entry(self._catalogue, label) if self._catalogue is not None else None
        resource = resource_of(entry) if entry is not None else None
        if resource is None or code not in _FREED_BY_TAKING:
            return ""
        return (
            f"{label!r} takes commands with the lease '{resource}'.{_held(resource, views)} Take it: {_call(resource)}."
        )


def _held(resource: str, views: Mapping[str, LeaseView]) -> str:
    view = views.get(resource)
    if view is None or view.holder is None or view.is_mine:
        return ""
    return f" {view.holder.name or view.holder.peer_id[:8]} holds it."


def _call(resource: str) -> str:
    return f"`await connection.control.take({resource!r})`"
