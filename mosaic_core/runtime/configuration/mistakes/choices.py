"""Tells the mistake of a value that may be one of several things once: pydantic complains of each of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TypeAlias

from pydantic_core import ErrorDetails

from mosaic_core.contract.declared.expectations import expectation
from mosaic_core.runtime.configuration.yaml_document import Place, YamlDocument

ToldMistake: TypeAlias = tuple[ErrorDetails, str]
"""A mistake, and what else could stand in its place."""


def told_once(mistakes: Sequence[ErrorDetails], document: YamlDocument, base: Place) -> Iterator[ToldMistake]:
    """The mistakes, and of a value that may be several things those of the one that was probably meant: it has the
    fewest. If each has one of the same value, they are told as one."""
    choices: dict[Place, dict[str, list[ToldMistake]]] = {}
    for one, word in _told_once([_of_tag(one) for one in mistakes]):
        place, choice = _choice(one, document, base)
        choices.setdefault(place, {}).setdefault(choice, []).append((one, word))
    for its in choices.values():
        first, *others = sorted(its.values(), key=len)
        if not others or len(first) > 1:
            yield from first
            continue
        (one, word), place = first[0], real_place(first[0][0]["loc"], document, base)
        same = [other for (other, _), *more in others if not more and real_place(other["loc"], document, base) == place]
        words = [word, *(expectation(other, "")[0].removeprefix("expected ") for other in same)]
        yield one, " or ".join(dict.fromkeys(filter(None, words)))


def _choice(one: ErrorDetails, document: YamlDocument, base: Place) -> tuple[Place, str]:
    """Where a value may be several things, and of which of them ``one`` speaks."""
    place, *rest = base, *one["loc"]
    if one["type"] == "missing":
        rest.pop()
    for part in rest:
        if not document.has((*place, part)):
            return place, str(part)
        place = (*place, part)
    return (*base, *one["loc"]), ""


def _of_tag(mistake: ErrorDetails) -> ErrorDetails:
    """What is said of the field that tells models apart, as of any field with few values."""
    context = mistake.get("ctx", {})
    loc = (*mistake["loc"], str(context.get("discriminator", "")).strip("'"))
    if mistake["type"] == "union_tag_not_found":
        return {**mistake, "type": "missing", "loc": loc}
    if mistake["type"] == "union_tag_invalid":
        choices = {"expected": str(context["expected_tags"]).replace(", ", " or ")}
        return {**mistake, "type": "literal_error", "loc": loc, "input": context["tag"], "ctx": choices}
    return mistake


def _told_once(mistakes: Sequence[ErrorDetails]) -> Iterator[ToldMistake]:
    """Each mistake, and the word (``'off'``) that could stand in its place: where a value or a word is taken, pydantic
    complains once about either."""
    words = {one["loc"][:-1]: one for one in mistakes if "".join(map(str, one["loc"][-1:])).startswith("literal[")}
    words = {loc: one for loc, one in words.items() if any(_is_beside(other, one) for other in mistakes)}
    for one in mistakes:
        if one not in words.values():
            word = words.get(one["loc"][:-1])
            yield one, "" if word is None else str(word.get("ctx", {}).get("expected", ""))


def _is_beside(other: ErrorDetails, one: ErrorDetails) -> bool:
    """Whether ``other`` is another opinion on the value that ``one`` speaks of, or on something in it."""
    loc = one["loc"]
    return len(other["loc"]) >= len(loc) and other["loc"][: len(loc) - 1] == loc[:-1] and other["loc"] != loc


def real_place(loc: tuple[int | str, ...], document: YamlDocument, base: Place) -> Place:
    """Pydantic's location as a place of the file; names of union members, which the file lacks, are left out."""
    place = base
    for part in loc:
        if document.has((*place, part)):
            place = (*place, part)
    return place
