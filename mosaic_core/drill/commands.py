"""Makes a valid command for any receiver from its message schema, its motion fields and its limits."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, replace
from typing import Any

from mosaic_core.contract.declared.nested_models import is_model
from mosaic_core.contract.handler import DataChannelReceivable, Refused, message_type_of
from mosaic_core.contract.message_schema import schema_of
from mosaic_core.drill.fields import Lists, at, in_lists, put
from mosaic_core.machines.delivery.framing import PayloadKind
from mosaic_core.runtime.commands.payload import PayloadReader
from mosaic_core.runtime.configuration.receiver_safety import ReceiverSafety
from mosaic_core.words.limits import FieldLimit

GENTLE = 0.1
"""What a drill moves by at most, in the message's own unit: enough to see, little enough to survive."""
SEEN_S = 0.5
"""A slew that takes so long is seen: it is several commands long."""
_DEPTH = 12
_FORMATS = {
    "date-time": "2026-01-01T00:00:00Z", "date": "2026-01-01", "time": "00:00:00Z", "email": "drill@example.org",
    "uuid": "00000000-0000-4000-8000-000000000000", "uri": "https://example.org/", "duration": "PT1S",
}  # fmt: skip


class NoCommand(Exception):
    """A receiver has no valid message that the drill could make; the text says why."""


@dataclass(frozen=True, slots=True)
class DrillCommand:
    """A message that moves a receiver a little. ``fields``: the dotted paths of velocities, ``positions``: those of
    positions; ``moved``: the velocity that is not zero here, or else a position."""

    message: Any
    kind: PayloadKind
    fields: tuple[str, ...] = ()
    moved: str = ""
    positions: tuple[str, ...] = ()
    lists: Lists = ()

    def at(self, message: Any, field: str) -> float:
        """The number that ``message`` has in ``field``; 0 where there is none."""
        return at(message, field, self.lists)

    def placed(self, where: Callable[[str], float | None]) -> DrillCommand:
        """The same message with the positions that are known by ``where``: it is told to be where it is."""
        message = deepcopy(self.message)
        for field in self.positions:
            value = where(field)
            if value is not None:
                put(message, field, value, self.lists)
        return replace(self, message=message)

    def payload(self) -> bytes:
        if self.kind is PayloadKind.BYTES:
            return bytes(self.message)
        return str(self.message).encode() if self.kind is PayloadKind.STRING else json.dumps(self.message).encode()

    def with_value(self, field: str, text: str) -> bytes:
        """The same message with ``text``, raw JSON, in one field: for values that no honest program sends."""
        mark = "\u0000drill\u0000"
        message = deepcopy(self.message)
        put(message, field, mark, self.lists)
        return json.dumps(message).replace(json.dumps(mark), text).encode()


def moving_command(handler: DataChannelReceivable[Any], safety: ReceiverSafety) -> DrillCommand:
    """A command for this receiver; raises :class:`NoCommand`."""
    wanted = message_type_of(type(handler))
    if wanted is bytes:
        return DrillCommand(b"\x00", PayloadKind.BYTES)
    if wanted is str:
        return DrillCommand("drill", PayloadKind.STRING)
    fields = tuple(field for field in motion_fields(safety) if field not in safety.position_fields)
    schema = schema_of(wanted) if is_model(wanted) else {}
    message = example_of(schema, schema)
    if not isinstance(message, dict):
        message = {}
    for field in fields:
        put(message, field, 0)
    moved = next((field for field in fields if _move(message, field, schema, safety.limits)), "")
    positions = _placed(message, handler, safety, schema)
    moved = moved or next(iter(positions), "")
    command = DrillCommand(message, PayloadKind.JSON, fields, moved, positions, safety.lists)
    try:
        PayloadReader(handler).read(command.payload())
    except Refused as refused:
        raise NoCommand(f"no valid message could be made from its schema ({refused.message or refused.code})") from None
    return command


def _placed(
    message: dict[str, Any], handler: DataChannelReceivable[Any], safety: ReceiverSafety, schema: Mapping[str, Any]
) -> tuple[str, ...]:
    """Put every position into ``message``, at rest within its range; their fields. Raises :class:`NoCommand`."""
    positions = in_lists(safety.position_fields, safety.lists, handler.item_names, message)
    for one in safety.lists:
        if not any(one.holds(field) for field in positions):
            how = f"`item_names` in {type(handler).__name__}, or one of them in `limits`"
            raise NoCommand(f"nobody says which numbers '{one.path}' may have: name them as {how}")
    for field in positions:
        place = resting_place(safety.limits_on(field))
        put(message, field, nearest_to(place, schema_at(schema, field)), safety.lists)
    return tuple(positions)


def motion_fields(safety: ReceiverSafety) -> tuple[str, ...]:
    """Everything that means motion: what the connector names and what is limited."""
    limited = (field for limit in safety.limits for field in limit.fields)
    return tuple(dict.fromkeys((*safety.motion_fields, *limited)))


def resting_place(its: Sequence[FieldLimit]) -> float:
    """A place in the range of a position with these limits, so far from 0, where the range allows, that a slew from 0
    would be seen."""
    low = max((limit.min for limit in its if limit.min is not None), default=None)
    high = min((limit.max for limit in its if limit.max is not None), default=None)
    norms = (limit.max_norm / 2 for limit in its if limit.max_norm is not None)
    rates = (limit.max_rate_per_s * SEEN_S for limit in its if limit.max_rate_per_s is not None)
    enough = min(min(rates, default=1.0), min(norms, default=math.inf))
    if low is not None and high is not None:
        middle = (low + high) / 2
        return middle if abs(middle) >= enough else max(low, high, key=abs)
    return max(low, enough) if low is not None else enough if high is None else min(high, enough)


def example_of(schema: Mapping[str, Any], root: Mapping[str, Any], depth: int = 0) -> Any:
    """A small value that fits a JSON Schema: what is required and nothing else. Raises :class:`NoCommand`."""
    if depth > _DEPTH:
        raise NoCommand("its schema refers to itself without an end")
    schema = _resolved(schema, root)
    for key in ("const", "default"):
        if key in schema:
            return schema[key]
    for key in ("enum", "examples"):
        if schema.get(key):
            return schema[key][0]
    if "prefixItems" in schema:
        return [example_of(item, root, depth + 1) for item in schema["prefixItems"]]
    for key in ("anyOf", "oneOf", "allOf"):
        if schema.get(key):
            return example_of(_first_real(schema[key]), root, depth + 1)
    return _example_of_type(schema, root, depth)


def _example_of_type(schema: Mapping[str, Any], root: Mapping[str, Any], depth: int) -> Any:
    kind = schema.get("type", "object" if "properties" in schema else "null")
    if isinstance(kind, Sequence) and not isinstance(kind, str):
        kind = next((one for one in kind if one != "null"), "null")
    match kind:
        case "object":
            properties = schema.get("properties", {})
            return {name: example_of(properties.get(name, {}), root, depth + 1) for name in schema.get("required", ())}
        case "array":
            return [example_of(schema.get("items", {}), root, depth + 1)] * int(schema.get("minItems", 0))
        case "number" | "integer":
            return nearest_to(0, schema, is_whole=kind == "integer")
        case "string":
            if "pattern" in schema:
                raise NoCommand(f"one of its texts must match {schema['pattern']!r}")
            return _FORMATS.get(schema.get("format", ""), "x" * int(schema.get("minLength", 0)))
        case "boolean":
            return False
        case _:
            return None


def nearest_to(wish: float, schema: Mapping[str, Any], *, is_whole: bool = False) -> float:
    """The number nearest to ``wish`` within the bounds of a schema."""
    step = schema.get("multipleOf") or (1 if is_whole else 1e-3)
    low = max(schema.get("minimum", -math.inf), schema.get("exclusiveMinimum", -math.inf) + step)
    high = min(schema.get("maximum", math.inf), schema.get("exclusiveMaximum", math.inf) - step)
    value: float = min(max(wish, low), high)
    return math.ceil(value) if is_whole else value


def schema_at(schema: Mapping[str, Any], field: str) -> Mapping[str, Any]:
    """The schema of one field by its dotted path; empty where it says nothing about it."""
    here: Mapping[str, Any] = _resolved(schema, schema)
    for name in field.split("."):
        here = _resolved(here.get("properties", {}).get(name, {}), schema)
        for key in ("anyOf", "oneOf", "allOf"):
            if here.get(key):
                here = _resolved(_first_real(here[key]), schema)
    return here


def _move(message: dict[str, Any], field: str, schema: Mapping[str, Any], limits: Iterable[FieldLimit]) -> bool:
    """Give one field a gentle value; ``False`` where only zero is allowed."""
    own = schema_at(schema, field)
    bounds = [limit for limit in limits if field in limit.fields]
    highest = min([b for limit in bounds for b in (limit.max, limit.max_norm) if b is not None], default=math.inf)
    lowest = max([-b for limit in bounds for b in (limit.max_norm,) if b is not None], default=-math.inf)
    lowest = max([limit.min for limit in bounds if limit.min is not None], default=lowest)
    is_whole = own.get("type") == "integer"
    for wish in (min(GENTLE, highest / 2), max(-GENTLE, lowest / 2)):
        value = nearest_to(math.copysign(1, wish) if is_whole and wish else wish, own, is_whole=is_whole)
        if value and lowest <= value <= highest:
            put(message, field, value)
            return True
    return False


def _resolved(schema: Mapping[str, Any], root: Mapping[str, Any]) -> Mapping[str, Any]:
    for _ in range(_DEPTH):
        reference = schema.get("$ref")
        if not isinstance(reference, str):
            return schema
        found: Any = root
        for name in reference.removeprefix("#/").split("/"):
            found = found.get(name, {}) if isinstance(found, Mapping) else {}
        schema = {**found, **{key: value for key, value in schema.items() if key != "$ref"}}
    raise NoCommand("its schema refers to itself without an end")


def _first_real(choices: Sequence[Mapping[str, Any]]) -> Mapping[str, Any]:
    return next((choice for choice in choices if choice.get("type") != "null"), choices[0])
