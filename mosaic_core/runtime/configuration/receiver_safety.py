"""Merges the safety limits of one receiver: the YAML file's limits where it says something, else the handler's own."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from mosaic_core.contract.handler import DataChannelReceivable
from mosaic_core.words.config import SafetyConfig
from mosaic_core.words.limits import NO_SLOW_DOWN, FieldLimit, SlowDownCurves
from mosaic_core.words.safety_config import SafePolicy


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
    curves: SlowDownCurves = NO_SLOW_DOWN
    takes_observers: bool = False

    @property
    def is_motion(self) -> bool:
        """It moves something: a stop concerns it."""
        return self.timeout_s is not None or self.resource is not None

    @property
    def is_slowed(self) -> bool:
        return self.curves != NO_SLOW_DOWN and self.has_fields

    @property
    def has_fields(self) -> bool:
        """Some number of its messages is limited, scaled, or set to zero."""
        return bool(self.limits or self.motion_fields or self.position_fields)

    @classmethod
    def of(cls, config: SafetyConfig, handler: DataChannelReceivable[Any]) -> ReceiverSafety:
        """Raises :class:`~mosaic_core.words.limits.ImpossibleLimit`."""
        limits = config.every_limit(handler.position_fields)
        limited = (field for limit in limits if limit.kind == "position" for field in limit.fields)
        return cls(
            timeout_s=handler.timeout_s if config.timeout_s is None else config.timeout_s,
            on_timeout=config.on_timeout,
            on_loss=config.on_loss or config.on_timeout,
            resource=resource_of(config, handler),
            max_rate_hz=config.max_rate_hz,
            limits=limits,
            motion_fields=handler.motion_fields,
            position_fields=tuple(dict.fromkeys((*handler.position_fields, *limited))),
            curves=_curves(config, handler),
            takes_observers=handler.takes_observers,
        )


def resource_of(config: SafetyConfig, handler: DataChannelReceivable[Any]) -> str | None:
    """Whose lease the commands of this receiver need; ``None``: nobody's."""
    needs_lease = handler.requires_lease if config.requires_lease is None else config.requires_lease
    return config.resource if needs_lease else None


def _curves(config: SafetyConfig, handler: DataChannelReceivable[Any]) -> SlowDownCurves:
    if config.slow_down == "off":
        return NO_SLOW_DOWN
    if config.slow_down is not None:
        return config.slow_down.curves()
    return SlowDownCurves() if handler.motion_fields or handler.position_fields else NO_SLOW_DOWN
