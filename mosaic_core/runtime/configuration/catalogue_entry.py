"""Derives the catalogue entries of a connector, which operators see, from its handlers: nothing is written twice."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from mosaic_core.contract.declared.nested_models import is_model
from mosaic_core.contract.handler import DataChannelReceivable, Handler, message_type_of, sent_type_of
from mosaic_core.contract.message_schema import schema_of
from mosaic_core.contract.request_handler import RequestHandler, answer_schema
from mosaic_core.runtime.configuration.connector import HandlerGroup, handler_groups, terms_for
from mosaic_core.runtime.configuration.receiver_safety import bounds_of, timeout_of
from mosaic_core.runtime.widgets.widget_modules import announced_module
from mosaic_core.words.catalogue import CatalogueEntry, ChannelEntry
from mosaic_core.words.config import SafetyConfig
from mosaic_core.words.data_type import MosaicDataType
from mosaic_core.words.delivery import DeliveryContract
from mosaic_core.words.safety_config import SlowDown

_NOTHING = SafetyConfig()


def effective_safety(safety: SafetyConfig, handler: DataChannelReceivable[Any]) -> SafetyConfig:
    """The file's limits of one receiver; where it says nothing, the receiver's own count."""
    more: dict[str, Any] = {"limits": bounds_of(handler, safety), "timeout_s": timeout_of(safety, handler)}
    if safety.requires_lease is None and handler.requires_lease:
        more["requires_lease"] = True
    if "resource" not in safety.model_fields_set:
        more["resource"] = handler.resource
    if safety.slow_down is None and (handler.motion_fields or handler.position_fields):
        more["slow_down"] = SlowDown()
    return safety.model_copy(update=more)


def catalogue_entries(
    label: str,
    connector_type: str,
    handlers: Sequence[Handler],
    safety: SafetyConfig = _NOTHING,
    delivery: DeliveryContract | None = None,
) -> tuple[CatalogueEntry, ...]:
    """The entries of one connector, one for each track and channel. ``safety`` and ``delivery``: what the file says."""
    groups = handler_groups(label, handlers)
    entries = (_entry(group, connector_type, safety, delivery) for group in groups)
    if len(groups) == 1:
        return tuple(entries)
    return tuple(entry.model_copy(update={"connector": label}) for entry in entries)


def _entry(
    group: HandlerGroup, connector_type: str, safety: SafetyConfig, delivery: DeliveryContract | None
) -> CatalogueEntry:
    first = group.handlers[0]
    channels = [one for one in group.handlers if one.data_type is not MosaicDataType.MEDIA and not one.is_for_originals]
    hint = next((handler.widget for handler in group.handlers if handler.widget), None)
    return CatalogueEntry(
        label=group.label,
        type=connector_type,
        kind=first.kind,
        data_type=first.data_type,
        direction=group.direction,
        channels=tuple(ChannelEntry(label=one.label, data_type=one.data_type) for one in channels),
        delivery=terms_for(first, delivery).mode,
        widget=hint,
        widget_module=announced_module(hint),
        safety=safety_limits(safety, group.handlers),
        **_messages_of(first),
    )


def _messages_of(handler: Handler) -> dict[str, Any]:
    """The shapes of what travels on its channel."""
    sent = sent_type_of(type(handler)) if isinstance(handler, DataChannelReceivable) else None
    return {
        "schema_id": getattr(message_type_of(type(handler)), "schema_id", "") or None,
        "message_schema": message_schema(handler),
        "sent_schema_id": getattr(sent, "schema_id", "") or None,
        "sent_schema": None if sent is None else schema_of(sent, "serialization"),
        "answer_schema": answer_schema(type(handler)) if isinstance(handler, RequestHandler) else None,
        "answer_within_s": handler.answer_within_s if isinstance(handler, RequestHandler) else None,
        "item_names": (tuple(handler.item_names) or None) if isinstance(handler, DataChannelReceivable) else None,
    }


def message_schema(handler: Handler) -> dict[str, Any] | None:
    """JSON Schema, with units, of one message; ``None`` where the handler has no message type."""
    message_type = message_type_of(type(handler))
    if not is_model(message_type):
        return None
    receives = isinstance(handler, DataChannelReceivable)
    return schema_of(message_type, "validation" if receives else "serialization")


def receivers(handlers: Sequence[Handler]) -> list[DataChannelReceivable[Any]]:
    return [handler for handler in handlers if isinstance(handler, DataChannelReceivable)]


def safety_limits(safety: SafetyConfig, handlers: Sequence[Handler]) -> dict[str, Any] | None:
    """The limits as the catalogue shows them, of several receivers the strictest; ``None`` where nothing is received or
    limited."""
    its = [effective_safety(safety, handler) for handler in receivers(handlers)]
    if not its:
        return None
    strictest = _strictest(its)
    limits = strictest.model_dump(mode="json", exclude_none=True)
    if not limits["limits"]:
        del limits["limits"]
    if not strictest.requires_lease:
        del limits["resource"]
    if strictest.timeout_s is None or strictest.on_timeout == "callback":
        del limits["on_timeout"]
    return limits or None


def _strictest(its: Sequence[SafetyConfig]) -> SafetyConfig:
    """The shortest time-out, a lease if any needs one, and all limits."""
    leased = next((one for one in its if one.requires_lease), its[0])
    timeouts = [one.timeout_s for one in its if one.timeout_s is not None]
    slow_down = next((one.slow_down for one in its if one.slow_down is not None), None)
    limits = {field: bounds for one in reversed(its) for field, bounds in one.limits.items()}
    more = {"timeout_s": min(timeouts, default=None), "slow_down": slow_down, "limits": limits}
    return leased.model_copy(update=more)
