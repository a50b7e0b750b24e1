"""Tells a slip of the pen from a name of somebody's own."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches

_ALIKE = 0.8
"""What is less alike may well be meant as it is written."""


def slip_of(word: str, known: Iterable[str]) -> str | None:
    """The known word that ``word`` was meant to be, if it is so much like one that another meaning is unlikely."""
    return next(iter(get_close_matches(word, list(known), 1, _ALIKE)), None)
