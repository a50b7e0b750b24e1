"""Checks what a robot needs that runs for months: known messages, units, quick ends, quiet losses of devices, safe
motion."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping
from typing import Any

from pydantic import BaseModel

from mosaic_core.contract.declared.nested_models import is_model
from mosaic_core.contract.handler import DataChannelReceivable, has_safe_action, message_type_of
from mosaic_core.contract.message_schema import schema_of
from mosaic_core.contract.units import KNOWN_UNITS, unit_of
from mosaic_core.doctor.code_checks import blocking_lines
from mosaic_core.drill.drill import drill
from mosaic_core.drill.rig import is_request
from mosaic_core.ladder.absent_devices import absent_device_errors
from mosaic_core.ladder.examinee import Examinee
from mosaic_core.ladder.fault import DoesNotApply, Fault, NotJudged
from mosaic_core.ladder.live_exercises import hurried, live_failures
from mosaic_core.ladder.lives import is_absence, lived
from mosaic_core.ladder.rule import ConnectorRule, ShipmentRule
from mosaic_core.ladder.shipment import Shipment
from mosaic_core.ladder.source_places import CORE_FOLDER, place_of_class, place_of_field
from mosaic_core.runtime.configuration.mistakes.guard_hints import acts_on_the_loop, says_motion
from mosaic_core.runtime.configuration.receiver_safety import ReceiverSafety
from mosaic_core.runtime.threads.handler_thread import STOP_PATIENCE_S
from mosaic_core.words.data_type import MosaicDataType
from mosaic_core.words.errors import CodeLine, hint_at

KIT = "mosaic_core.testing"
DRILLED = (
    "safe-action", "silence", "disconnect", "leaves", "holds-position", "stop", "not-a-number", "out-of-range",
)  # fmt: skip
"""The exercises that end one way or another by what a class declares. The rest is the framework's own."""


def messages_are_typed(one: Examinee) -> Iterator[Fault]:
    for handler in one.handlers:
        wanted = message_type_of(type(handler))
        is_json = handler.data_type in (MosaicDataType.JSON_R2U, MosaicDataType.JSON_U2R, MosaicDataType.JSON_BI)
        if is_json and not handler.is_for_originals and wanted is not Any and not is_model(wanted):
            yield Fault(f"{type(handler).__name__} has no type of message", place_of_class(type(handler)))


def messages_have_units(one: Examinee) -> Iterator[Fault]:
    yield from _without_units(one.message_models())


def params_have_units(one: Examinee) -> Iterator[Fault]:
    yield from _without_units(one.param_models())


def _without_units(models: list[type[BaseModel]]) -> Iterator[Fault]:
    for model in models:
        for name, field in schema_of(model).get("properties", {}).items():
            declared = next((key for key, info in model.model_fields.items() if name in (key, info.alias)), name)
            what = _wrong_unit(declared, field)
            if not what:
                continue
            place = place_of_field(model, declared)
            # A model without a line is made as it runs from what others defined, such as the messages of a robot.
            if place.line is not None and not place.file.startswith(CORE_FOLDER):
                yield Fault(f"{model.__name__}.{declared} {what}", place)


def _wrong_unit(declared: str, field: Mapping[str, Any]) -> str:
    if "unit" in field:
        said = str(field["unit"])
        return "" if said in KNOWN_UNITS else f"has a unit that nobody knows, '{said}'{hint_at(said, KNOWN_UNITS)}"
    return "is a number without a unit" if _is_number(field) and not unit_of(declared, field) else ""


def _is_number(field: Mapping[str, Any]) -> bool:
    """Whether it measures something. Whole numbers count or choose, and one of a fixed choice is a name."""
    if "enum" in field or "const" in field:
        return False
    choices = [inner for kind in ("anyOf", "oneOf", "allOf") for inner in field.get(kind, ())]
    items = field.get("items")
    inner = [*choices, *([items] if isinstance(items, Mapping) else []), *field.get("prefixItems", ())]
    return field.get("type") == "number" or any(map(_is_number, inner))


async def survives_restarts(one: Examinee) -> list[Fault]:
    life = await lived(one)
    return [one.fault(error, f"run {number} ends with") for number, error in life.bugs]


async def hears_stop(one: Examinee) -> list[Fault]:
    life = await lived(one)
    if life.stop_s < STOP_PATIENCE_S:
        return []
    message = f"it had not stopped after {STOP_PATIENCE_S:g} s, and was left behind with its thread"
    return [Fault(message, place) for place in life.stuck] or [Fault(message, one.place)]


async def absent_devices_are_gone(one: Examinee) -> list[Fault]:
    errors = await absent_device_errors(one)
    if not errors:
        raise DoesNotApply("no param of its example names a device or a host that it could not do without")
    return [
        one.fault(error, f"with {name}: {value} it raises") for name, value, error in errors if not is_absence(error)
    ]


def blocks_nothing(one: Shipment) -> Iterator[Fault]:
    for file in one.code():
        try:
            found = list(blocking_lines(file.read_text("utf-8")))
        except (OSError, SyntaxError, ValueError):
            continue  # whoever imports it hears of it
        for line, what in found:
            yield Fault(f"{what} in an `async def`", CodeLine(str(file), line))


def tests_use_the_kit(one: Shipment) -> Iterator[Fault]:
    tests = one.tests()
    if tests is None:
        raise NotJudged("no source tree is at hand: name the folder of the plugin")
    if not any(_imports_kit(file.read_text("utf-8", errors="replace")) for file in tests):
        yield Fault(f"none of its tests imports {KIT}", CodeLine(str(one.tree / "tests" if one.tree else "")))


def _imports_kit(text: str) -> bool:
    try:
        tree = ast.parse(text)
    except (SyntaxError, ValueError):
        return False
    named = (node.module or "" for node in ast.walk(tree) if isinstance(node, ast.ImportFrom))
    plain = (alias.name for node in ast.walk(tree) if isinstance(node, ast.Import) for alias in node.names)
    return any(name.startswith(KIT) for name in (*named, *plain))


def motion_is_guarded(one: Examinee) -> Iterator[Fault]:
    for receiver, safety in _moving(one):
        kind = type(receiver)
        if safety.timeout_s is None:
            yield Fault(f"{kind.__name__} moves and has no timeout_s", place_of_class(kind))
        if not has_safe_action(kind):
            yield Fault(f"{kind.__name__} moves and has no make_safe()", place_of_class(kind))
        if not (says_motion(kind) or safety.motion_fields or safety.position_fields or safety.limits):
            yield Fault(f"{kind.__name__} names no motion_fields or position_fields", place_of_class(kind))
        if acts_on_the_loop(receiver):
            yield Fault(f"{kind.__name__} moves in an `async def handle_data`", place_of_class(kind))


def _moving(one: Examinee) -> list[tuple[DataChannelReceivable[Any], ReceiverSafety]]:
    """The receivers that move something, with their limits."""
    connector = one.connector(one.trial)
    receivers = [one for one in connector.handlers if isinstance(one, DataChannelReceivable) and not is_request(one)]
    guarded = [(receiver, ReceiverSafety.of(connector.safety, receiver)) for receiver in receivers]
    found = [(receiver, safety) for receiver, safety in guarded if safety.is_motion and not _rests(receiver, safety)]
    if not found:
        raise DoesNotApply("it moves nothing")
    return found


def _rests(receiver: DataChannelReceivable[Any], safety: ReceiverSafety) -> bool:
    """Whether its author says that it moves nothing by itself, as a switch under a lease does."""
    is_guarded = safety.timeout_s is not None or safety.has_fields
    return says_motion(type(receiver)) and not is_guarded


async def passes_the_drill(one: Examinee) -> list[Fault]:
    kinds = {receiver.label: type(receiver) for receiver, _ in _moving(one)}
    found = [finding async for finding in drill(hurried(one.configured(one.trial)), only=DRILLED)]
    failed = [
        (kinds[finding.label], f"{finding.exercise}: {finding.why}")
        for finding in found
        if finding.verdict == "failed" and finding.label in kinds
    ]
    return [Fault(what, place_of_class(kind)) for kind, what in failed or await live_failures(one)]


SILVER = (
    ConnectorRule(
        "typed-messages", "silver", "Whatever it sends or takes as JSON has a model, or says `Any` on purpose.",
        "The catalogue carries its schema: no widget knows what it shows otherwise, and nothing is checked.",
        "Derive the message from Message, and the handler from DataChannelSendable[MyMessage].", messages_are_typed,
    ),
    ConnectorRule(
        "message-units", "silver", "Each number of a message that is not whole has a unit.",
        "An operator who reads 12 must know whether it is volts or percent.",
        'End the name with the unit (voltage_v), or say it: Field(json_schema_extra=unit("V")); unit("") says that it '
        "has none.", messages_have_units,
    ),
    ConnectorRule(
        "param-units", "silver", "Each number of the params that is not whole has a unit.",
        "Who writes the file must know whether 5 is seconds or hertz.",
        'End the name with the unit (period_s), or say it: Field(json_schema_extra=unit("Hz")); unit("") says that it '
        "has none.", params_have_units,
    ),
    ConnectorRule(
        "starts-again", "silver", "It runs, stops and runs again.",
        "After a failure, and for each first viewer, the body of the same handler begins anew.",
        "Keep what a run needs in local names and `with` blocks of the body, not in the handler.", survives_restarts,
    ),
    ConnectorRule(
        "hears-stop", "silver", f"It stops within {STOP_PATIENCE_S:g} s, also while it answers a question.",
        "What does not is abandoned with its thread and its device, and the robot's end waits for it.",
        "Wait with self.pause or self.every, in an answer with request.pause; give reads of devices a time-out.",
        hears_stop,
    ),
    ConnectorRule(
        "device-gone", "silver", "A device or a host that is not there is DeviceGone.",
        "That is one quiet line and another try; any other error is told as a bug, with a traceback.",
        "Where the device is opened: raise DeviceGone(message, cure) from the error.", absent_devices_are_gone,
    ),
    ShipmentRule(
        "blocks-nothing", "silver", "No `async def` waits in a way that stops the event loop.",
        "All connectors and all operators wait with it.",
        "Write `async for … in self.every(…)`, or make the body a `def`.", blocks_nothing,
    ),
    ShipmentRule(
        "tests-with-kit", "silver", f"It has tests that use `{KIT}`.",
        "They hold what was promised, without a device, a network or waiting.",
        "Begin with `mosaic plugin new`, which writes some; build, collect and feed are enough.", tests_use_the_kit,
    ),
    ConnectorRule(
        "motion-guarded", "silver",
        "What moves has a time-out, a safe action and a plain handle_data, and says which fields "
        "are motion.",
        "A lost operator must not leave it moving, limits need to know what to limit, and a command that waits on the "
        "event loop makes everybody wait.",
        "Give the class timeout_s, make_safe(), a plain `def handle_data`, and motion_fields or position_fields; "
        "`motion_fields = ()` says that it moves nothing.", motion_is_guarded,
    ),
    ConnectorRule(
        "safety-drill", "silver",
        "What moves passes the exercises of the safety drill that its class decides; with a `trial` also live.",
        "Silence, a dead link, a stop, strangers: each ends in the safe action, in time.",
        "Run `mosaic safety drill` on a file with it, also with --live; docs/topics/safety.md explains each exercise.",
        passes_the_drill,
        mostly_waits=True,
    ),
)  # fmt: skip
"""In the order in which they are asked and told."""
