"""Finds the known name that a misspelt word was probably meant to be."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


def nearest(word: str, known: Iterable[str]) -> str | None:
    """The known name that ``word`` was probably meant to be."""
    by_lower = {name.lower(): name for name in sorted(known, reverse=True)}
    match = difflib.get_close_matches(word.lower(), by_lower, n=1, cutoff=0.6)
    return by_lower[match[0]] if match else None


def guess(word: str, known: Iterable[str], otherwise: str = "") -> str:
    """The cure for a word that nobody knows: the name that was probably meant, else ``otherwise``."""
    match = nearest(word, known)
    return f"did you mean '{match}'?" if match else otherwise
