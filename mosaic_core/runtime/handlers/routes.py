"""Which handler a channel's label leads to, made once from the built connectors."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar

from mosaic_core.contract.data_tap import TappedChannel
from mosaic_core.contract.handler import (
    AudioReceivable,
    AudioTrackHandler,
    DataChannelReceivable,
    Handler,
    MediaTrackHandler,
    message_type_of,
)
from mosaic_core.machines.commands.release_first import PAUSE_S
from mosaic_core.machines.delivery.delivery_terms import DeliveryTerms
from mosaic_core.machines.delivery.send_scheduler import Priority
from mosaic_core.runtime.configuration.catalogue_entry import message_schema
from mosaic_core.runtime.configuration.connector import Connector
from mosaic_core.runtime.configuration.receiver_safety import ReceiverSafety
from mosaic_core.runtime.handlers.receiver import Receiver
from mosaic_core.runtime.observation.counters import ConnectorCounters
from mosaic_core.words.data_type import Delivery

H = TypeVar("H", bound=Handler)

LATEST_MAX_AGE_S = 1.0
"""A ``latest`` message for a receiver without time-out that took this much longer than the fastest is worthless."""


@dataclass(slots=True)
class Route:
    """The route of one data channel: where its messages go and come from."""

    label: str
    connector: Connector
    handler: Handler
    counters: ConnectorCounters
    safety: ReceiverSafety
    receiver: Receiver | None = None

    @property
    def terms(self) -> DeliveryTerms:
        """How its messages travel."""
        return self.connector.terms_of(self.handler)

    @property
    def priority(self) -> Priority:
        return self.terms.priority

    @property
    def is_latest(self) -> bool:
        return self.terms.mode is Delivery.LATEST

    @property
    def max_age_s(self) -> float | None:
        """How late a framed message may be; ``None``: it is not judged by age. A late command must not act, whoever
        promised to deliver it in order; a late request may."""
        if not isinstance(self.handler, DataChannelReceivable):
            return None
        if self.safety.timeout_s is not None:
            return self.safety.timeout_s
        return LATEST_MAX_AGE_S if self.is_latest else None

    @property
    def release_pause_s(self) -> float:
        """A sender that says nothing for so long has let go."""
        return self.safety.timeout_s or PAUSE_S


def data_routes(connectors: Sequence[Connector], counters: dict[str, ConnectorCounters]) -> dict[str, Route]:
    """Every data channel by its label. ``counters``: by the handler's label."""
    return {
        handler.label: Route(handler.label, connector, handler, counters[handler.label], _safety(connector, handler))
        for connector, handler in handlers_of(connectors, Handler)
        if not isinstance(handler, MediaTrackHandler | AudioTrackHandler | AudioReceivable)
    }


def tapped_channels(routes: Mapping[str, Route]) -> dict[str, TappedChannel]:
    """The channels that can be tapped, in the order of the YAML file: all but those for originals, which repeat what
    another one has."""
    return {
        label: TappedChannel(
            label,
            route.connector.config.type,
            route.handler.data_type,
            getattr(message_type_of(type(route.handler)), "schema_id", ""),
            message_schema(route.handler),
        )
        for label, route in routes.items()
        if not route.handler.is_for_originals
    }


def original_groups(connectors: Sequence[Connector]) -> dict[str, tuple[str, ...]]:
    """Of handlers with channels for original dashboards alone: by each of these labels, and by that of the handler that
    they repeat, all of them; that one comes first."""
    groups: dict[str, tuple[str, ...]] = {}
    for group in (group for connector in connectors for group in connector.groups):
        labels = tuple(handler.label for handler in group.handlers if handler.is_for_originals)
        if labels:
            members = tuple(dict.fromkeys((group.handlers[0].label, *labels)))
            groups.update(dict.fromkeys(members, members))
    return groups


def _safety(connector: Connector, handler: Handler) -> ReceiverSafety:
    if isinstance(handler, DataChannelReceivable):
        return ReceiverSafety.of(connector.safety, handler)
    return ReceiverSafety()


def handlers_of(connectors: Sequence[Connector], kind: type[H]) -> Iterator[tuple[Connector, H]]:
    """Every handler of this kind with its connector, in the order of the YAML file."""
    for connector in connectors:
        for handler in connector.handlers:
            if isinstance(handler, kind):
                yield connector, handler
