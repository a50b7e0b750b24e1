"""Merges the safety limits of one receiver: the YAML file's limits where it says something, else the handler's own."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from mosaic_core.contract.field_kinds import kind_of, own_kind
from mosaic_core.contract.handler import DataChannelReceivable, message_type_of
from mosaic_core.contract.message_fields import MessageFields, has_two_names, message_fields
from mosaic_core.contract.request_handler import RequestHandler
from mosaic_core.machines.commands.number_list import NumberList
from mosaic_core.words.config import SafetyConfig
from mosaic_core.words.limits import NO_SLOW_DOWN, FieldLimit, MotionKind, SlowDownCurves
from mosaic_core.words.safety_config import FieldBounds, SafePolicy


@dataclass(frozen=True, slots=True)
class ReceiverSafety:
    """The effective safety of one receiver. ``resource``: whose lease its commands need; ``None``: nobody's."""

    timeout_s: float | None = None
    on_timeout: SafePolicy = "callback"
    on_loss: SafePolicy = "callback"
    resource: str | None = None
    max_rate_hz: float | None = None
    limits: tuple[FieldLimit, ...] = ()
    motion_fields: tuple[str, ...] = ()
    position_fields: tuple[str, ...] = ()
    lists: tuple[NumberList, ...] = ()
    """The lists that have position fields."""
    curves: SlowDownCurves = NO_SLOW_DOWN
    takes_observers: bool = False

    @property
    def is_motion(self) -> bool:
        """It moves something: a stop concerns it, also where nothing guards it."""
        is_guarded = self.timeout_s is not None or self.resource is not None
        return is_guarded or bool(self.motion_fields or self.position_fields)

    @property
    def is_slowed(self) -> bool:
        return self.curves != NO_SLOW_DOWN and self.has_fields

    def limits_on(self, field: str) -> list[FieldLimit]:
        """The limits of a field; of one in a list that none names those of ``path.*``."""
        own = [limit for limit in self.limits if field in limit.fields]
        its = next((one for one in self.lists if one.holds(field)), None)
        return own or [limit for limit in self.limits if its is not None and its.every in limit.fields]

    def range_of(self, field: str) -> tuple[float, float]:
        """The least and the greatest value of a field; infinite where nothing bounds it."""
        limits = self.limits_on(field)
        low = max((one.min for one in limits if one.min is not None), default=-math.inf)
        return low, min((one.max for one in limits if one.max is not None), default=math.inf)

    @property
    def has_fields(self) -> bool:
        """Some number of its messages is limited, scaled, or set to zero."""
        return bool(self.limits or self.motion_fields or self.position_fields)

    @classmethod
    def of(cls, config: SafetyConfig, handler: DataChannelReceivable[Any]) -> ReceiverSafety:
        """Raises :class:`~mosaic_core.words.limits.ImpossibleLimit`."""
        limits = limits_of(handler, config)
        limited = (field for limit in limits if limit.kind == "position" for field in limit.fields)
        positions = tuple(dict.fromkeys((*handler.position_fields, *limited)))
        lists = fields_of(handler, config).lists
        return cls(
            timeout_s=timeout_of(config, handler),
            on_timeout=config.on_timeout,
            on_loss=config.on_loss or config.on_timeout,
            resource=resource_of(config, handler),
            max_rate_hz=config.max_rate_hz,
            limits=limits,
            motion_fields=handler.motion_fields,
            position_fields=positions,
            lists=tuple(one for one in lists if any(one.holds(field) for field in positions)),
            curves=_curves(config, handler),
            takes_observers=handler.takes_observers,
        )


def timeout_of(config: SafetyConfig, handler: DataChannelReceivable[Any]) -> float | None:
    """The silence that it may last; whoever answers requests has another bound."""
    if isinstance(handler, RequestHandler):
        return None
    return handler.timeout_s if config.timeout_s is None else config.timeout_s


def resource_of(config: SafetyConfig, handler: DataChannelReceivable[Any]) -> str | None:
    """Whose lease the commands of this receiver need; ``None``: nobody's."""
    needs_lease = handler.requires_lease if config.requires_lease is None else config.requires_lease
    resource = config.resource if "resource" in config.model_fields_set else handler.resource
    return resource if needs_lease else None


def _curves(config: SafetyConfig, handler: DataChannelReceivable[Any]) -> SlowDownCurves:
    if config.slow_down == "off":
        return NO_SLOW_DOWN
    if config.slow_down is not None:
        return config.slow_down.curves()
    return SlowDownCurves() if handler.motion_fields or handler.position_fields else NO_SLOW_DOWN


def fields_of(handler: DataChannelReceivable[Any], config: SafetyConfig) -> MessageFields:
    """What its messages have: of those without a schema, the lists that a field is spelt in."""
    used = (*handler.motion_fields, *handler.position_fields, *handler.limits, *config.limits)
    return message_fields(message_type_of(type(handler)), used, handler.item_names)


def bounds_of(handler: DataChannelReceivable[Any], config: SafetyConfig) -> dict[str, FieldBounds]:
    """The bounds of each field that its messages have, in the order of the class and then of the file: what the file
    says of another receiver of the same connector is none of its business."""
    merged, fields = dict(handler.limits), fields_of(handler, config)
    for field, bounds in config.limits.items():
        if takes_field(handler, fields, field):
            merged[field] = bounds.over(merged.get(field, FieldBounds()))
    return merged


def takes_field(handler: DataChannelReceivable[Any], fields: MessageFields, field: str) -> bool:
    """Whether a limit of ``field`` may be meant for this receiver; ``fields``: what its messages have."""
    if isinstance(handler, RequestHandler) or fields.message_type in (str, bytes):
        return False
    return fields.has(field) or has_two_names(fields.message_type, field.split("."))


def with_those_of_all(bounds: dict[str, FieldBounds], fields: MessageFields) -> dict[str, FieldBounds]:
    """What a number of a list does not say itself, ``path.*`` says for it."""
    lists = {field: fields.list_of(field) for field in bounds}
    every = {field: bounds[its.every] for field, its in lists.items() if its is not None and its.every in bounds}
    return {field: its.over(every[field]) if field in every else its for field, its in bounds.items()}


def limits_of(handler: DataChannelReceivable[Any], config: SafetyConfig) -> tuple[FieldLimit, ...]:
    """All its limits, each of its kind. Raises :class:`~mosaic_core.words.limits.ImpossibleLimit`."""
    fields = fields_of(handler, config)
    bounds = with_those_of_all(bounds_of(handler, config), fields)
    kinds = (handler.motion_fields, handler.position_fields)
    its = (one.limit(field, kind_of(field, one, fields, *kinds)) for field, one in bounds.items())
    return (*config.field_limits(), *its)


def kind_for(handler: DataChannelReceivable[Any], config: SafetyConfig, field: str) -> MotionKind | None:
    """What the connector itself calls a field."""
    own = own_kind(field, fields_of(handler, config), handler.motion_fields, handler.position_fields)
    return own or next((limit.kind for limit in config.field_limits() if field in limit.fields), None)
