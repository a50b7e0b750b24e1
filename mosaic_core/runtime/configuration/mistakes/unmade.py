"""Tells why a connector could not be made: its configurer refused these params, or its code failed."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

from pydantic import ValidationError

from mosaic_core.contract.handler import Handler
from mosaic_core.runtime.configuration.checked_config import CheckedConnector
from mosaic_core.runtime.threads.code_places import explained_error, raised_at
from mosaic_core.words.errors import NOWHERE, CodeLine, ConfigError, DeviceGone, MosaicError, Problem

_PART = re.compile(r"[^.\[\]]+")
_OPENS_LATER = (
    "open the device in the body, or by a Keeper, and raise DeviceGone there: the robot starts without it, then"
)


def unmade(one: CheckedConnector, error: BaseException) -> Iterator[Problem]:
    """The problems of a connector whose configurer raised ``error``. What says that the configuration is wrong belongs
    to its params in the file; anything else is a mistake of its author."""
    if isinstance(error, ConfigError):
        for its in error.problems:
            yield _refused(one, its.message, its.path, its.cure)
    elif isinstance(error, MosaicError) and error.code == "config.invalid":
        yield _refused(one, error.message.removesuffix(error.cure).strip(), "", error.cure)
    elif isinstance(error, ValueError) and not isinstance(error, ValidationError | UnicodeError):
        yield _refused(one, f"{error}{raised_at(error).in_brackets}", "", "")
    else:
        yield broken_by(one, error)


def broken_by(one: CheckedConnector, error: BaseException) -> Problem:
    """What its author did wrong, as an error of the code tells."""
    if isinstance(error, OSError | DeviceGone):
        return broken(one, explained_error(error), cure=_OPENS_LATER, at=raised_at(error))
    cure = error.cure if isinstance(error, MosaicError) else ""
    return broken(one, explained_error(error).removesuffix(cure).rstrip(), cure=cure, at=raised_at(error))


def broken(one: CheckedConnector, cause: str, *, cure: str = "", at: CodeLine = NOWHERE) -> Problem:
    """What its author did wrong."""
    return one.broken(f"{one.whose} can't be made: {cause}", cure=cure, at=at)


def no_handler(made: object, parts: Sequence[object]) -> tuple[str, str]:
    """What is wrong with what ``configure()`` returned, and the cure. ``parts``: what it is made of."""
    wrong = next((part for part in parts if not isinstance(part, Handler)), made)
    cure = "return a handler, or a sequence of them"
    if isinstance(wrong, type) and issubclass(wrong, Handler):
        cure = f"return one of it: {wrong.__name__}(self.label, …)"
    elif isinstance(wrong, Iterator):
        cure = "return list(…) of it"
    if wrong is made:
        said = _called(made) if parts else "an empty sequence"
        return f"configure() returned {said} instead of a handler", cure
    number, names = list(parts).index(wrong) + 1, ", ".join(map(_called, parts))
    return f"configure() returned ({names}), of which number {number} is no handler", cure


def _called(part: object) -> str:
    """By its class: whatever else it says of itself is the author's."""
    if part is None:
        return "None"
    return f"the class {part.__name__}" if isinstance(part, type) else f"one {type(part).__name__}"


def _refused(one: CheckedConnector, message: str, path: str, cure: str) -> Problem:
    """``path``: from the params on, as its configurer calls it."""
    keys = [int(part) if part.isdigit() else part for part in _PART.findall(path)]
    place = (*one.place, "params", *keys)
    return one.document.problem(place, f"{one.whose} refuses its params: {message}", cure=cure)
