"""Derives the catalogue entry of a connector, which operators see, from its handlers: nothing is written twice."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from pydantic import BaseModel

from mosaic_core.contract.handler import DataChannelReceivable, Handler, message_type_of
from mosaic_core.contract.request_handler import RequestHandler, answer_schema
from mosaic_core.machines.delivery.delivery_terms import terms_of
from mosaic_core.runtime.widgets.widget_modules import announced_module
from mosaic_core.words.catalogue import CatalogueEntry, ChannelEntry
from mosaic_core.words.config import SafetyConfig
from mosaic_core.words.data_type import Direction, MosaicDataType
from mosaic_core.words.safety_config import SlowDown


def effective_safety(safety: SafetyConfig, handlers: Sequence[Handler]) -> SafetyConfig:
    """The file's limits; where it says nothing, the handlers' own count."""
    own = [handler.timeout_s for handler in receivers(handlers) if handler.timeout_s is not None]
    more: dict[str, Any] = {}
    if safety.timeout_s is None and own:
        more["timeout_s"] = min(own)
    if safety.requires_lease is None and any(handler.requires_lease for handler in receivers(handlers)):
        more["requires_lease"] = True
    if safety.slow_down is None and any(one.motion_fields or one.position_fields for one in receivers(handlers)):
        more["slow_down"] = SlowDown()
    return safety.model_copy(update=more)


def catalogue_entry(label: str, connector_type: str, handlers: Sequence[Handler]) -> CatalogueEntry:
    """The entry, without its safety; ``delivery`` is the handler's own."""
    first = handlers[0]
    directions = {handler.direction for handler in handlers}
    return CatalogueEntry(
        label=label,
        type=connector_type,
        kind=first.kind,
        data_type=first.data_type,
        direction=directions.pop() if len(directions) == 1 else Direction.BOTH,
        channels=tuple(
            ChannelEntry(label=handler.label, data_type=handler.data_type)
            for handler in handlers
            if handler.data_type is not MosaicDataType.MEDIA and not handler.is_for_originals
        ),
        delivery=terms_of(first.delivery).mode,
        widget=widget_hint(handlers),
        widget_module=announced_module(widget_hint(handlers)),
        schema_id=getattr(message_type_of(type(first)), "schema_id", "") or None,
        message_schema=message_schema(first),
        answer_schema=answer_schema(type(first)) if isinstance(first, RequestHandler) else None,
    )


def widget_hint(handlers: Sequence[Handler]) -> str | None:
    """The widget that the first handler with an opinion names."""
    return next((handler.widget for handler in handlers if handler.widget), None)


def message_schema(handler: Handler) -> dict[str, Any] | None:
    """JSON Schema, with units, of one message; ``None`` where the handler has no message type."""
    message_type = message_type_of(type(handler))
    if not (isinstance(message_type, type) and issubclass(message_type, BaseModel)):
        return None
    receives = isinstance(handler, DataChannelReceivable)
    return message_type.model_json_schema(mode="validation" if receives else "serialization")


def receivers(handlers: Sequence[Handler]) -> list[DataChannelReceivable[Any]]:
    return [handler for handler in handlers if isinstance(handler, DataChannelReceivable)]


def safety_limits(safety: SafetyConfig, handlers: Sequence[Handler]) -> dict[str, Any] | None:
    """The limits as the catalogue shows them; ``None`` where nothing is received or limited."""
    if not receivers(handlers):
        return None
    limits = safety.model_dump(mode="json", exclude_none=True)
    if not limits["limits"]:
        del limits["limits"]
    if not safety.requires_lease:
        del limits["resource"]
    if safety.timeout_s is None or safety.on_timeout == "callback":
        del limits["on_timeout"]
    return limits or None
