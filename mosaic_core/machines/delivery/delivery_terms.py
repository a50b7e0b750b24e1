"""Merges a connector's own choice of delivery with the YAML file's: the terms under which its data travels."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from mosaic_core.machines.delivery.send_scheduler import LIMITS, Priority, QueueLimits
from mosaic_core.words.data_type import Delivery
from mosaic_core.words.delivery import DeliveryContract

PRIORITIES = {Delivery.RELIABLE: Priority.RELIABLE, Delivery.LATEST: Priority.LATEST, Delivery.BULK: Priority.BULK}


@dataclass(frozen=True, slots=True)
class DeliveryTerms:
    """Everything decided. ``limits`` hold for one operator's queue, ``max_rate_hz`` for what goes to everybody
    (``None``: no limit), ``latch``: late joiners get the last message."""

    mode: Delivery
    limits: QueueLimits
    max_rate_hz: float | None
    latch: bool

    @property
    def priority(self) -> Priority:
        return PRIORITIES[self.mode]


def chosen(own: Delivery | DeliveryContract, wanted: DeliveryContract | None) -> DeliveryContract:
    """The handler's own contract, overridden key by key where the file's mode is the same, as a whole where not."""
    default = DeliveryContract(mode=own) if isinstance(own, Delivery) else own
    if wanted is None:
        return default
    own_mode = default.mode or Delivery.RELIABLE
    if wanted.mode not in (None, own_mode):
        return wanted
    said = {name: value for name, value in wanted if value is not None}
    return default.model_copy(update={"mode": own_mode, **said})


def terms_of(contract: DeliveryContract | Delivery) -> DeliveryTerms:
    """Fill in what the mode usually has. ``contract``: what :func:`chosen` says."""
    contract = chosen(contract, None)
    mode = contract.mode or Delivery.RELIABLE
    usual = LIMITS[PRIORITIES[mode]]
    newest_wins = usual.newest_wins if contract.newest_wins is None else contract.newest_wins
    limits = QueueLimits(
        messages=contract.queue_messages or (1 if newest_wins else usual.messages),
        size_bytes=contract.queue_bytes or usual.size_bytes,
        newest_wins=newest_wins,
    )
    latch = mode is not Delivery.BULK if contract.latch is None else contract.latch
    return DeliveryTerms(mode, limits, contract.max_rate_hz, latch)


def contradictions(contract: DeliveryContract, *, sends: bool, is_media: bool) -> Iterator[tuple[str, str, str]]:
    """``(key, what is wrong, cure)`` of what can't be meant. ``contract``: what :func:`chosen` says; ``sends``:
    whether the connector sends data, ``is_media``: whether it is a picture or sound."""
    said = {name for name, value in contract if value is not None} - {"mode"}
    if is_media:
        if contract.mode is not Delivery.LATEST:
            yield "mode", f"pictures and sound are never delivered as '{contract.mode}'", "leave `delivery` out"
        for key in sorted(said):
            yield key, f"'{key}' does nothing for pictures and sound", "their pace and bounds are params"
        return
    if contract.mode is Delivery.LATEST:
        if contract.queue_messages not in (None, 1):
            yield "queue_messages", "'latest' keeps one message: the newest", "for a queue choose `reliable` or `bulk`"
        if contract.newest_wins is False:
            yield "newest_wins", "under 'latest' the newest always wins", "for a queue choose `reliable` or `bulk`"
    elif contract.newest_wins and contract.mode is not Delivery.BULK:
        message = "'reliable' loses nothing, so no newer message may push out an older one"
        yield "newest_wins", message, "choose `latest`, or `bulk` for large messages"
    if not sends:
        cures = {"max_rate_hz": "`safety.max_rate_hz` limits what is taken", "latch": "leave it out"}
        for key in sorted(said & cures.keys()):
            yield key, f"'{key}' is about sending, and this connector only receives", cures[key]
