"""Tells what is in force for a connector type when the YAML file says nothing, from the handlers that it makes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, TypeAlias

from mosaic_core.cli.configuration.connector_description import message_rows
from mosaic_core.contract.configurer import Configurer
from mosaic_core.contract.declared.nested_models import is_model
from mosaic_core.contract.example import example_of
from mosaic_core.contract.handler import DataChannelReceivable, has_safe_action, message_type_of
from mosaic_core.contract.message_schema import schema_of
from mosaic_core.contract.request_handler import RequestHandler
from mosaic_core.contract.units import unit_of
from mosaic_core.harness.building import checked_entry
from mosaic_core.runtime.configuration.auto_configurer import AutoConfigurer
from mosaic_core.runtime.configuration.connector import HandlerGroup
from mosaic_core.runtime.configuration.hook_calls import hook_plugins
from mosaic_core.runtime.configuration.mistakes.example_hints import refusal
from mosaic_core.runtime.configuration.receiver_safety import ReceiverSafety, fields_of
from mosaic_core.runtime.configuration.resolver import ConnectorResolver, InstalledConnector
from mosaic_core.runtime.threads.code_places import explained_error, raised_at, said_at
from mosaic_core.words.config import SafetyConfig
from mosaic_core.words.data_type import Direction, MosaicDataType
from mosaic_core.words.errors import ConfigError, Problem, without_place
from mosaic_core.words.limits import FieldLimit

ChannelDefaults: TypeAlias = dict[str, Any]
_BOUNDS = ("min", "max", "max_norm", "max_rise_per_s", "max_fall_per_s", "max_rate_per_s")


class Unmade(Exception):
    """The connector that its example does not make; the text says why. ``problems``: what ``mosaic validate`` says.
    ``is_broken``: whoever wrote the type has to mend it, as no params of a user's own are missing."""

    def __init__(self, problems: Sequence[Problem], *, is_broken: bool) -> None:
        super().__init__("; ".join(map(str, problems)))
        self.problems, self.is_broken = tuple(problems), is_broken


def defaults_of(
    connector_type: str, configurer: type[Configurer[Any]], installed: InstalledConnector | None = None
) -> list[ChannelDefaults]:
    """What is in force of each channel that operators see, as JSON values. ``installed``: who ships the type. Raises
    :class:`Unmade`."""
    example = example_of(connector_type, configurer)
    entry = {"params": example.get("params", {}), "safety": {}, "delivery": None}
    try:
        one = checked_entry(configurer, example["label"], entry, installed)
        made = AutoConfigurer(resolver=ConnectorResolver([]), plugins=hook_plugins([])).alone(one)
    except ConfigError as error:
        raise _unmade(configurer, error.problems) from None
    except Exception as error:  # noqa: BLE001 - a plugin's validators may fail in any way
        at = raised_at(error)
        problem = Problem(without_place(explained_error(error), at), "config.broken_plugin", *at)
        raise _unmade(configurer, [problem]) from None
    pairs = zip(made.entries, made.groups, strict=True)
    return [_channel(one.wire(), group, made.safety) for one, group in pairs]


def _unmade(configurer: type[Configurer[Any]], problems: Sequence[Problem]) -> Unmade:
    if configurer.example is not None and (cause := refusal(configurer, configurer.example)):
        said = f"the example of {configurer.__name__} is refused by its own params: {cause}"
        return Unmade([Problem(said, "config.broken_plugin", *said_at(configurer, "example"))], is_broken=True)
    is_own = configurer.example is not None
    needs = any(field.is_required() for field in configurer.params_model.model_fields.values())
    codes = {problem.code for problem in problems}
    return Unmade(problems, is_broken=is_own or (not needs and codes != {"config.invalid"}))


def _channel(entry: dict[str, Any], group: HandlerGroup, safety: SafetyConfig) -> ChannelDefaults:
    is_media = group.handlers[0].data_type is MosaicDataType.MEDIA
    names = ("label", "kind", "dataType", "direction", "schemaId", "sentSchemaId", "widget")
    channel = {_snake(name): entry.get(name) for name in names}
    channel["delivery"] = None if is_media else entry["delivery"]
    taking = [one for one in group.handlers if isinstance(one, DataChannelReceivable)]
    takes, sends = _messages(entry)
    channel["takes"], channel["sends"] = _fields(takes), _fields(sends)
    channel["safety"] = [_safety(one, ReceiverSafety.of(safety, one)) for one in taking]
    return channel


def _messages(entry: dict[str, Any]) -> tuple[dict[str, Any] | None, dict[str, Any] | None]:
    """The schemas of what it takes and of what it sends; ``None`` where nothing goes that way, or nobody says what."""
    message = entry.get("messageSchema")
    if entry["direction"] == Direction.TO_OPERATOR:
        return None, message
    return message, entry.get("sentSchema") or entry.get("answerSchema")


def _fields(schema: dict[str, Any] | None) -> list[dict[str, Any]]:
    return [
        {"name": name, "type": kind, "required": default == "required", "unit": unit, "description": description}
        for name, kind, default, unit, description in (message_rows(schema) if schema else ())
    ]


def _snake(name: str) -> str:
    return "".join(f"_{letter.lower()}" if letter.isupper() else letter for letter in name)


def _safety(handler: DataChannelReceivable[Any], its: ReceiverSafety) -> dict[str, Any]:
    return {
        "channel": handler.label,
        "requires_lease": its.resource is not None,
        "resource": its.resource or handler.resource,
        "timeout_s": its.timeout_s,
        "safe_action": has_safe_action(type(handler)),
        "reports_position": type(handler).reported_position is not DataChannelReceivable.reported_position,
        "motion_fields": list(its.motion_fields),
        "position_fields": list(its.position_fields),
        "slowed_down": its.is_slowed,
        "limits": [_limit(one, handler) for one in its.limits],
        "answers": {"at_once": handler.at_once, "within_s": handler.answer_within_s}
        if isinstance(handler, RequestHandler)
        else None,
    }


def _limit(limit: FieldLimit, handler: DataChannelReceivable[Any]) -> dict[str, Any]:
    bounds = {name: getattr(limit, name) for name in _BOUNDS if getattr(limit, name) is not None}
    return {"fields": list(limit.fields), "kind": limit.kind, "unit": _unit(limit.fields[0], handler), **bounds}


def _unit(field: str, handler: DataChannelReceivable[Any]) -> str:
    """The unit of a number of its messages, of one in a list that of the list."""
    message_type = message_type_of(type(handler))
    if not is_model(message_type):
        return ""
    its = fields_of(handler, SafetyConfig()).list_of(field)
    schema = schema_of(message_type)
    node, name = schema, ""
    for name in (field if its is None else its.path).split("."):
        node = node.get("properties", {}).get(name, {})
        reference = next((one["$ref"] for one in (node, *node.get("allOf", ())) if "$ref" in one), None)
        node = schema.get("$defs", {}).get(str(reference).rsplit("/", 1)[-1], {}) if reference else node
    return unit_of(name, node)


def lines_of(channel: ChannelDefaults) -> Iterator[tuple[str, str]]:
    """``(what, how)`` of one channel, for people."""
    yield "data type", f"{channel['data_type']}, {channel['direction']}"
    for name, words in (("schema_id", "schema"), ("sent_schema_id", "schema of what it sends"), ("widget", "widget")):
        if channel[name]:
            yield words, channel[name]
    if channel["delivery"]:
        yield "delivery", channel["delivery"]
    for safety in channel["safety"]:
        yield from _safety_lines(safety)


def _safety_lines(safety: dict[str, Any]) -> Iterator[tuple[str, str]]:
    yield "lease", f"of '{safety['resource']}'" if safety["requires_lease"] else "none is needed"
    if its := safety["answers"]:
        yield "answers", f"within {its['within_s']:g} s (answer_within_s), {its['at_once']} at once (at_once)"
        return
    yield "time-out", "none" if safety["timeout_s"] is None else f"{safety['timeout_s']:g} s"
    yield "safe action", "written (make_safe)" if safety["safe_action"] else "none"
    for kind in ("motion", "position"):
        if safety[f"{kind}_fields"]:
            yield f"{kind} fields", ", ".join(safety[f"{kind}_fields"])
    if safety["position_fields"]:
        yield "position", "reported (reported_position)" if safety["reports_position"] else "not reported"
    if safety["motion_fields"] or safety["position_fields"]:
        yield "on a bad link", "slowed down" if safety["slowed_down"] else "as ever"
    for limit in safety["limits"]:
        yield f"limit of {' and '.join(limit['fields'])}", _limit_words(limit)
    if not safety["limits"]:
        yield "limits", "none"


def _limit_words(limit: dict[str, Any]) -> str:
    unit, bounds = f" {limit['unit']}" if limit["unit"] else "", [name for name in _BOUNDS if name in limit]
    words = [f"{name} {limit[name]:g}{unit}{'/s' if name.endswith('_per_s') else ''}" for name in bounds]
    return f"{limit['kind']}: {', '.join(words) or 'no bounds'}"
