"""Makes whole numbers of what the limits leave of a command where its class takes no others."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from functools import partial
from typing import Any

from mosaic_core.contract.message_schema import alternatives_of, nodes_on
from mosaic_core.machines.commands.message_numbers import put, value_at
from mosaic_core.runtime.configuration.receiver_safety import ReceiverSafety


class WholeNumbers:
    """The fields of one receiver that are whole numbers. ``schema``: the JSON Schema of its messages; ``velocities``,
    which are rounded towards 0, and ``positions``, which stay in their ranges: dotted paths."""

    def __init__(
        self, schema: Mapping[str, Any], velocities: Iterable[str], positions: Iterable[str], safety: ReceiverSafety
    ) -> None:
        ways: dict[str, Callable[[float], int]] = dict.fromkeys(velocities, math.trunc)
        ways |= {field: partial(_rounded, safety.range_of(field)) for field in positions}
        ways |= {one.path: partial(_rounded, safety.range_of(one.every)) for one in safety.lists}
        paths = ((tuple(field.split(".")), whole) for field, whole in ways.items())
        self._fields = [(path, whole) for path, whole in paths if _is_whole(schema, path)]

    def made_of(self, limited: dict[str, Any], wished: Mapping[str, Any]) -> dict[str, Any]:
        """``limited`` with a whole number for each that the limits have made of what was ``wished``. What was wished
        stays as it is, also where it is none: that is refused."""
        shaped = dict(limited)
        for path, whole in self._fields:
            with suppress(KeyError):
                value, wish = value_at(limited, path, ""), value_at(wished, path, "")
                if isinstance(value, list):
                    pairs = zip(value, wish, strict=True)
                    value = [one if one == other else whole(one) for one, other in pairs]
                put(shaped, limited, path, value if isinstance(value, list) or value == wish else whole(value))
        return shaped


def _rounded(within: tuple[float, float], value: float) -> int:
    low, high = within
    whole = round(value)
    if whole > high:
        return math.floor(high)
    return math.ceil(low) if whole < low else whole


def _is_whole(schema: Mapping[str, Any], path: tuple[str, ...]) -> bool:
    """Whether it is an integer, or a list of such, and no fraction as well."""
    *_, node = nodes_on(schema, path)
    kinds = {one.get("type") for one in alternatives_of(schema, node)}
    items = [one["items"] for one in alternatives_of(schema, node) if isinstance(one.get("items"), Mapping)]
    kinds |= {one.get("type") for item in items for one in alternatives_of(schema, item)}
    return "integer" in kinds and "number" not in kinds
