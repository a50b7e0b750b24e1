"""Cameras that ``params`` name and the robot does not have: told before anything starts, with the nearest label that it
has.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence, Set
from typing import Any, TypeAlias

from pydantic import BaseModel

from mosaic_core.contract.handler import Handler, MediaTrackHandler
from mosaic_core.contract.params import CameraLabel
from mosaic_core.runtime.configuration.checked_config import CheckedConnector
from mosaic_core.runtime.configuration.config_problems import real_place
from mosaic_core.runtime.configuration.resolver import nearest
from mosaic_core.words.errors import Problem

WithHandlers: TypeAlias = tuple[CheckedConnector, tuple[Handler, ...]]
Loc: TypeAlias = tuple[int | str, ...]


def label_problems(made: Sequence[WithHandlers]) -> Iterator[Problem]:
    """Every :class:`CameraLabel` that is none. ``made``: all connectors that could be made; what the others of the file
    would have been, nobody knows."""
    types = {label: one.config.type for one, handlers in made for label in _labels(one, handlers)}
    cameras = [handler.label for _, handlers in made for handler in handlers if isinstance(handler, MediaTrackHandler)]
    unmade = _unmade([one for one, _ in made])
    for one, _ in made:
        for loc, label in named_in(one.params):
            if label in cameras or (label not in types and any(label.startswith(other) for other in unmade)):
                continue
            what = f"which is of type '{types[label]}'" if label in types else "which this robot does not have"
            message = f"connector '{one.config.label}' names the camera '{label}', {what}"
            place = real_place(loc, one.document, (*one.place, "params"))
            yield one.document.problem(place, message, cure=_cure(label, cameras, unmade))


def named_in(value: object, loc: Loc = ()) -> Iterator[tuple[Loc, CameraLabel]]:
    """The labels of cameras in ``params``, each with its way from there."""
    parts: Iterator[tuple[Any, Any]] = iter(())
    if isinstance(value, CameraLabel):
        yield loc, value
    elif isinstance(value, BaseModel):
        parts = ((name, getattr(value, name)) for name in type(value).model_fields)
    elif isinstance(value, Mapping):
        for key in value:
            yield from named_in(key, (*loc, key))
        parts = iter(value.items())
    elif isinstance(value, list | tuple | set | frozenset):
        parts = enumerate(value)
    for key, inner in parts:
        yield from named_in(inner, (*loc, key))


def _labels(one: CheckedConnector, handlers: tuple[Handler, ...]) -> Iterator[str]:
    yield one.config.label
    yield from (handler.label for handler in handlers)


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


def _cure(label: str, cameras: Sequence[str], unmade: Set[str]) -> str:
    guess = nearest(label, [*cameras, *sorted(unmade)])
    if guess:
        return f"did you mean '{guess}'?"
    return f"it has: {', '.join(cameras)}" if cameras else "add a camera with this label"
