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
    connector, ``label``. What only original dashboards know belongs to the first."""
    told = [handler for handler in handlers if not handler.is_for_originals]
    hidden = [handler for handler in handlers if handler.is_for_originals]
    groups: dict[str, list[Handler]] = {}
    for handler in told:
        groups.setdefault(label if handler.is_part else handler.label, []).append(handler)
    groups.setdefault(next(iter(groups), label), []).extend(hidden)
    return tuple(HandlerGroup(its, tuple(ones)) for its, ones in groups.items())


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
        """How the messages of one of its handlers travel; what only original dashboards know, as what they know it
        of."""
        return terms_for(self.handlers[0] if handler.is_for_originals else handler, self.config.delivery)
