"""Finds what a configuration can't mean of its handlers: deliveries, widgets that no plugin ships, and cameras that
``params`` name and the robot does not have. Told before anything starts, with the nearest name that would make sense.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, TypeAlias, TypeVar

from pydantic import BaseModel

from mosaic_core.contract.declared.code_lines import code_of
from mosaic_core.contract.handler import AudioTrackHandler, DataChannelReceivable, Handler, MediaTrackHandler
from mosaic_core.contract.media import EncodingParams
from mosaic_core.contract.params import CameraLabel, DataLabel, OwnFolder
from mosaic_core.contract.request_handler import RequestHandler
from mosaic_core.contract.sound import SoundEncoding
from mosaic_core.machines.delivery.delivery_terms import chosen, contradictions
from mosaic_core.runtime.configuration.checked_config import CheckedConnector
from mosaic_core.runtime.configuration.mistakes.choices import real_place
from mosaic_core.runtime.widgets.widget_modules import is_shipped, module_with
from mosaic_core.words.data_type import Direction, Kind, MosaicDataType
from mosaic_core.words.errors import MosaicError, Problem, guess


def delivery_problems(one: CheckedConnector, handlers: tuple[Handler, ...]) -> Iterator[Problem]:
    """Contradictions of what the file says, alone or together with the connector's own choice. Beside data channels it
    means only those: pictures and sound travel in their own way."""
    channels = [handler for handler in handlers if handler.data_type is not MosaicDataType.MEDIA]
    concerned = channels or handlers
    sends = any(handler.direction is not Direction.TO_ROBOT for handler in concerned)
    contracts = [chosen(handler.delivery, one.config.delivery) for handler in concerned]
    found = [its for contract in contracts for its in contradictions(contract, sends=sends, is_media=not channels)]
    for key, message, cure in dict.fromkeys(found):
        if one.config.delivery is not None and getattr(one.config.delivery, key) is not None:
            yield one.problem(f"connector '{one.config.label}': {message}", "delivery", key, cure=cure)
        else:
            at = code_of(type(concerned[0]))
            yield one.broken(f"{one.whose} chose a delivery that can't be: {message}", cure=cure, at=at)


_BODIES: tuple[tuple[type[Handler], str, str], ...] = (
    (RequestHandler, "answer", "answer(self, question, request)"),
    (DataChannelReceivable, "handle_data", "handle_data(self, data)"),
)


def body_problems(one: CheckedConnector, handlers: tuple[Handler, ...]) -> Iterator[Problem]:
    """Receivers whose author wrote nothing that takes what operators send."""
    for handler in handlers:
        base, name, words = next((its for its in _BODIES if isinstance(handler, its[0])), (None, "", ""))
        if base is not None and getattr(type(handler), name) is getattr(base, name):
            kind = type(handler).__name__
            message = f"{one.whose} takes messages of operators, and {kind} has no {name}: nothing reads them"
            yield one.broken(message, cure=f"write {words} in {kind}", at=code_of(type(handler)))


def encoding_problems(one: CheckedConnector, handlers: tuple[Handler, ...]) -> Iterator[Problem]:
    """A camera or a microphone whose params say how it is encoded, and which never takes them: what the file says of
    that would do nothing."""
    for params, base in ((EncodingParams, MediaTrackHandler), (SoundEncoding, AudioTrackHandler)):
        its = [handler for handler in handlers if isinstance(handler, base)]
        if its and isinstance(one.params, params) and all(handler.encoding is base.encoding for handler in its):
            kind, said = type(its[0]), ", ".join(params.model_fields)
            message = f"{one.whose}: {kind.__name__} takes nothing of what its params say of encoding ({said})"
            yield one.broken(
                message, cure=f"write self.encoding = params in {kind.__name__}.__init__", at=code_of(kind)
            )


def widget_problems(one: CheckedConnector, handlers: tuple[Handler, ...]) -> Iterator[Problem]:
    """A widget of a plugin, ``acme-arm/ArmPanel``, that is not where its distribution says."""
    is_installed = one.installed.entry_point.dist is not None or one.installed.local is not None
    named = {handler.widget: handler for handler in handlers if handler.widget and is_shipped(handler.widget)}
    for hint, handler in named.items() if is_installed else ():  # a test's connector is of no distribution
        try:
            module_with(hint)
        except MosaicError as error:
            message = f"{one.whose} names the widget '{hint}': {error.message}"
            yield one.broken(message, cure=error.cure, at=code_of(type(handler)))


WithHandlers: TypeAlias = tuple[CheckedConnector, tuple[Handler, ...]]
Loc: TypeAlias = tuple[int | str, ...]


def label_problems(made: Sequence[WithHandlers]) -> Iterator[Problem]:
    """Every :class:`CameraLabel` and :class:`DataLabel` that is none. ``made``: all connectors that could be made; what
    the others of the file would have been, nobody knows."""
    types = {
        label: one.config.type
        for one, handlers in made
        for label in (one.config.label, *(handler.label for handler in handlers))
    }
    every = [handler for _, handlers in made for handler in handlers]
    cameras = [handler.label for handler in every if isinstance(handler, MediaTrackHandler)]
    channels = [one.label for one in every if one.kind is Kind.DATA and not one.is_for_originals]
    unmade = _unmade([one for one, _ in made])
    for one, _ in made:
        yield from _wrong_labels(one, CameraLabel, "camera", cameras, types, unmade)
        yield from _wrong_labels(one, DataLabel, "data channel", channels, types, unmade)


L = TypeVar("L", CameraLabel, DataLabel)


def _wrong_labels(
    one: CheckedConnector, kind: type[L], noun: str, known: Sequence[str], types: Mapping[str, str], unmade: set[str]
) -> Iterator[Problem]:
    """The labels in ``params`` that are not ``known``. ``types``: of all labels, also of other kinds."""
    for loc, label in named_in(one.params, kind):
        if label in known or (label not in types and any(label.startswith(other) for other in unmade)):
            continue
        what = f"which is of type '{types[label]}'" if label in types else "which this robot does not have"
        message = f"connector '{one.config.label}' names the {noun} '{label}', {what}"
        place = real_place(loc, one.document, (*one.place, "params"))
        there_are = f"it has: {', '.join(known)}" if known else f"add a {noun} with this label"
        meant = guess(label, [*known, *sorted(unmade)])
        yield one.document.problem(place, message, cure=there_are, guess=meant)


N = TypeVar("N", CameraLabel, DataLabel, OwnFolder)


def named_in(value: object, kind: type[N], loc: Loc = ()) -> Iterator[tuple[Loc, N]]:
    """The texts of this kind in ``params``, each with its way from there."""
    parts: Iterator[tuple[Any, Any]] = iter(())
    if isinstance(value, kind):
        yield loc, value
    elif isinstance(value, BaseModel):
        parts = ((name, getattr(value, name)) for name in type(value).model_fields)
    elif isinstance(value, Mapping):
        for key in value:
            yield from named_in(key, kind, (*loc, key))
        parts = iter(value.items())
    elif isinstance(value, list | tuple | set | frozenset):
        parts = enumerate(value)
    for key, inner in parts:
        yield from named_in(inner, kind, (*loc, key))


def _unmade(made: Sequence[CheckedConnector]) -> set[str]:
    """Labels of connectors with mistakes of their own, whose handlers may have labels that begin like theirs. Empty
    text stands for one that depends on a missing variable and may be any."""
    if not made:
        return set()
    document, labels, found = made[0].document, {one.config.label for one in made}, set[str]()
    for index, raw in enumerate(document.tree.get("connectors") or ()):
        label = raw.get("label") if isinstance(raw, dict) else None
        if ("connectors", index, "label") in document.unknown:
            found.add("")
        elif label is not None and str(label) not in labels:
            found.add(str(label))
    return found
