"""Listens to ROS for the commands: everybody's endpoints, and the messages of one topic."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator, Sequence
from typing import Any

from mosaic_core.words.errors import MosaicError
from mosaic_ros2.bus.bus import Bus, BusError, HeardEndpoint
from mosaic_ros2.bus.qos import fitting
from mosaic_ros2.bus.ros_names import is_hidden, ros_name
from mosaic_ros2.bus.shared_bus import BusChoice, SharedBus, TypeChoice
from mosaic_ros2.bus.silence import NOTHING_CURE, is_of_every_node, why_other_type, why_silent
from mosaic_ros2.cdr.cursor import CdrError
from mosaic_ros2.cdr.decoding import Decoder
from mosaic_ros2.connectors.params import own_distribution, own_domain
from mosaic_ros2.conversion.conversions import CONVERSIONS
from mosaic_ros2.conversion.json_form import plain
from mosaic_ros2.definitions.definition import DefinitionError, full_name

LOOK_S = 0.1
_ACTION_PART = "/_action/send_goal"
MAX_SHOWN = 64
"""Numbers of one array that are shown; of a picture nobody reads them all."""


def chosen(
    domain: int | None, transport: str, interface: str, peers: Sequence[str], definitions: Sequence[str]
) -> BusChoice:
    """The bus that a command's options mean."""
    types = TypeChoice(tuple(definitions), own_distribution())
    return BusChoice(transport, own_domain() if domain is None else domain, interface, tuple(peers), types)


def heard(choice: BusChoice, wait_s: float) -> list[HeardEndpoint]:
    """Everybody who is heard within ``wait_s``. Raises :class:`MosaicError` if nobody is, saying what was tried."""
    with SharedBus(choice) as shared:
        bus = _joined(shared)
        time.sleep(wait_s)
        found = list(bus.endpoints())
        if not found:
            message = f"nothing of ROS was heard on {bus.where} in {wait_s:g} s"
            raise MosaicError(message, code="plugin.no_device", cure=NOTHING_CURE)
        return found


def topic_rows(endpoints: Sequence[HeardEndpoint], *, shows_all: bool) -> list[tuple[str, ...]]:
    """A row for each topic and type."""
    rows: list[tuple[str, ...]] = []
    of_topics = [one for one in endpoints if one.role in ("publisher", "subscription")]
    for name, kind in sorted({(one.name, one.type) for one in of_topics}):
        if shows_all or not is_hidden(name):
            here = [one for one in of_topics if (one.name, one.type) == (name, kind)]
            offers = [one.qos for one in here if one.role == "publisher"]
            offered = str(fitting(offers)) if offers else "–"
            rows.append((name, kind, str(len(offers)), str(len(here) - len(offers)), offered))
    return rows


def actions_in(endpoints: Sequence[HeardEndpoint]) -> dict[str, HeardEndpoint]:
    """The actions that are served, by name, with the server of their goals."""
    found = (one for one in endpoints if one.role == "server" and one.name.endswith(_ACTION_PART))
    return {one.name.removesuffix(_ACTION_PART): one for one in found}


def service_rows(endpoints: Sequence[HeardEndpoint], *, shows_all: bool) -> list[tuple[str, ...]]:
    """A row for each service and action."""
    rows = [
        (name, "action", one.type.removesuffix("_SendGoal"), _callable(one))
        for name, one in actions_in(endpoints).items()
    ]
    rows += [
        (one.name, "service", one.type, _callable(one))
        for one in endpoints
        if one.role == "server" and (shows_all or not (is_hidden(one.name) or is_of_every_node(one)))
    ]
    return sorted(set(rows))


def _callable(server: HeardEndpoint) -> str:
    return "no: Fast DDS builds requests another way" if server.is_foreign_service else "yes"


def echoed(choice: BusChoice, topic: str, type_name: str, wait_s: float, count: int) -> Iterator[str]:
    """The messages of a topic as lines of JSON, ``count`` of them (0: endless). Raises :class:`MosaicError`."""
    with SharedBus(choice) as shared:
        bus = _joined(shared)
        try:
            name, wanted = ros_name(topic), full_name(type_name) if type_name else ""
            yield from _lines(shared, bus, name, wanted, wait_s, count)
        except ValueError as error:
            raise MosaicError(str(error), code="plugin.no_device", cure="") from error


def _joined(shared: SharedBus) -> Bus:
    bus = shared.joined()
    try:
        bus.endpoints()
    except BusError as error:
        raise MosaicError(error.message, code=error.code, cure="") from error
    return bus


def _lines(shared: SharedBus, bus: Bus, topic: str, wanted: str, wait_s: float, count: int) -> Iterator[str]:
    publishers = _publishers(bus, topic, wait_s)
    problem = why_other_type(topic, wanted, publishers) if wanted else None
    if problem is not None:
        raise MosaicError(problem[0], code="plugin.no_device", cure=problem[1].replace("type: ", "--type "))
    kind = wanted or publishers[0].type
    if not shared.book.knows(kind):
        bus.learn_type(topic)
    try:
        decoder = Decoder(shared.book, kind)
    except DefinitionError as error:
        cure = "name its .msg file by --definitions, or start this in a shell that has sourced ROS"
        raise MosaicError(str(error), code="plugin.no_device", cure=cure) from error
    subscription = bus.subscribe(topic, kind, fitting([one.qos for one in publishers]))
    shown = 0
    try:
        while not count or shown < count:
            for arrived in subscription.take(LOOK_S):
                for message in _messages(kind, decoder, arrived.data):
                    yield json.dumps(message, ensure_ascii=False)
                    shown += 1
                    if shown == count:
                        return
    finally:
        subscription.close()


def _messages(kind: str, decoder: Decoder, data: bytes) -> list[Any]:
    try:
        message = decoder.decode(data)
        conversion = CONVERSIONS.get(kind)
        if conversion is None:
            return [_cut(plain({name: _short(value) for name, value in message.items()}))]
        return [_cut(one.model_dump(mode="json")) for one in conversion.convert(message)]
    except (CdrError, ValueError) as error:
        return [{"error": str(error)}]


def _short(value: Any) -> Any:
    """A picture's bytes are cut before they become a list."""
    return value[: MAX_SHOWN + 1] if hasattr(value, "dtype") and len(value) > MAX_SHOWN else value


def _cut(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: _cut(one) for name, one in value.items()}
    if isinstance(value, list):
        shown = [_cut(one) for one in value[:MAX_SHOWN]]
        return [*shown, "…"] if len(value) > MAX_SHOWN else shown
    return value


def _publishers(bus: Bus, topic: str, wait_s: float) -> list[HeardEndpoint]:
    until_s = time.monotonic() + wait_s
    while not (found := [one for one in bus.endpoints() if one.role == "publisher" and one.name == topic]):
        if time.monotonic() > until_s:
            message, cure = why_silent(topic, bus.where, bus.endpoints())
            raise MosaicError(message, code="plugin.no_device", cure=cure)
        time.sleep(LOOK_S)
    return found
