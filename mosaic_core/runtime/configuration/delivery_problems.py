"""What a ``delivery:`` says that can't be meant: told before anything starts, at the key, with the cure."""

from __future__ import annotations

from collections.abc import Iterator

from mosaic_core.contract.handler import Handler
from mosaic_core.machines.delivery.delivery_terms import chosen, contradictions
from mosaic_core.runtime.configuration.checked_config import CheckedConnector
from mosaic_core.words.data_type import Direction, MosaicDataType
from mosaic_core.words.errors import Problem


def delivery_problems(one: CheckedConnector, handlers: tuple[Handler, ...]) -> Iterator[Problem]:
    """Contradictions of what the file says, alone or together with the connector's own choice."""
    contract = chosen(handlers[0].delivery, one.config.delivery)
    sends = any(handler.direction is not Direction.TO_ROBOT for handler in handlers)
    is_media = all(handler.data_type is MosaicDataType.MEDIA for handler in handlers)
    for key, message, cure in contradictions(contract, sends=sends, is_media=is_media):
        if one.config.delivery is not None and getattr(one.config.delivery, key) is not None:
            yield one.problem(f"connector '{one.config.label}': {message}", "delivery", key, cure=cure)
        else:
            whose = f"connector '{one.config.label}' of {one.installed.source}"
            yield one.broken(f"{whose} chose a delivery that can't be: {message}", cure=cure)
