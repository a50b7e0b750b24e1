"""Declares a built connector: what its YAML entry became, ready for the robot to run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from mosaic_core.contract.handler import Handler
from mosaic_core.machines.delivery.delivery_terms import DeliveryTerms, chosen, terms_of
from mosaic_core.words.catalogue import CatalogueEntry
from mosaic_core.words.config import ConnectorConfig, SafetyConfig


@dataclass(frozen=True, slots=True)
class ChannelGroup:
    """The handlers of a connector that operators see as one: one card, one row of counters."""

    label: str
    handlers: tuple[Handler, ...]


def channel_groups(label: str, handlers: Sequence[Handler]) -> tuple[ChannelGroup, ...]:
    """All handlers of the connector ``label`` together, where it has one, or they mean something only so; else each of
    them. What only original dashboards know belongs to the first."""
    told = [handler for handler in handlers if not handler.is_for_originals]
    if len(told) < 2 or any(handler.is_part for handler in told):
        return (ChannelGroup(label, tuple(handlers)),)
    hidden = tuple(handler for handler in handlers if handler.is_for_originals)
    return tuple(ChannelGroup(one.label, (one, *hidden) if one is told[0] else (one,)) for one in told)


@dataclass(frozen=True, slots=True)
class Connector:
    """A connector with its handlers. ``safety``: what the YAML file says, which goes before what each handler
    says."""

    config: ConnectorConfig
    handlers: tuple[Handler, ...]
    entry: CatalogueEntry
    safety: SafetyConfig

    @property
    def groups(self) -> tuple[ChannelGroup, ...]:
        return channel_groups(self.config.label, self.handlers)

    def terms_of(self, handler: Handler) -> DeliveryTerms:
        """How the messages of one of its handlers travel: as the file says, or else the handler; what only original
        dashboards know, as what they know it of."""
        own = self.handlers[0] if handler.is_for_originals else handler
        return terms_of(chosen(own.delivery, self.config.delivery))
