"""Declares a built connector: what its YAML entry became, ready for the robot to run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from mosaic_core.contract.handler import Handler
from mosaic_core.machines.delivery.delivery_terms import DeliveryTerms, chosen, terms_of
from mosaic_core.words.catalogue import CatalogueEntry
from mosaic_core.words.config import ConnectorConfig, SafetyConfig
from mosaic_core.words.data_type import Direction, MosaicDataType
from mosaic_core.words.delivery import DeliveryContract


@dataclass(frozen=True, slots=True)
class HandlerGroup:
    """The handlers of a connector that operators see as one: one entry of the catalogue, one card, one row of
    counters."""

    label: str
    handlers: tuple[Handler, ...]

    @property
    def direction(self) -> Direction:
        directions = {handler.direction for handler in self.handlers}
        return directions.pop() if len(directions) == 1 else Direction.BOTH


def handler_groups(label: str, handlers: Sequence[Handler]) -> tuple[HandlerGroup, ...]:
    """Each handler for itself, under its own label; those that mean something only together as one, under that of the
    connector, ``label``. What only original dashboards know belongs to the handler that it repeats."""
    groups: dict[str, list[Handler]] = {}
    for handler in sorted(handlers, key=lambda one: one.is_for_originals):
        owner = repeated_by(handlers, handler)
        groups.setdefault(label if owner.is_part else owner.label, []).append(handler)
    return tuple(HandlerGroup(its, tuple(ones)) for its, ones in groups.items())


def repeated_by(handlers: Sequence[Handler], handler: Handler) -> Handler:
    """The handler whose messages one that only original dashboards know repeats in another form: the last one before it
    that all operators are told of, or the first of all. Any other repeats itself."""
    if not handler.is_for_originals:
        return handler
    before = handlers[: handlers.index(handler)]
    told = [one for one in handlers if not one.is_for_originals]
    return next((one for one in reversed(before) if one in told), told[0] if told else handler)


def terms_for(handler: Handler, wanted: DeliveryContract | None) -> DeliveryTerms:
    """How it travels: as the file says, ``wanted``, or else the handler; pictures and sound always in their own way."""
    is_media = handler.data_type is MosaicDataType.MEDIA
    return terms_of(chosen(handler.delivery, None if is_media else wanted))


@dataclass(frozen=True, slots=True)
class Connector:
    """A connector with its handlers. ``entries``: what the catalogue says of them, one entry for each of ``groups``.
    ``safety``: what the YAML file says, which goes before what each handler says."""

    config: ConnectorConfig
    handlers: tuple[Handler, ...]
    entries: tuple[CatalogueEntry, ...]
    safety: SafetyConfig

    @property
    def groups(self) -> tuple[HandlerGroup, ...]:
        return handler_groups(self.config.label, self.handlers)

    def terms_of(self, handler: Handler) -> DeliveryTerms:
        """How the messages of one of its handlers travel; what only original dashboards know, as what it repeats."""
        return terms_for(repeated_by(self.handlers, handler), self.config.delivery)
