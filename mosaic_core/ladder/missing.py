"""Says what keeps a plugin from the highest rung, for the plugin's own tests."""

from __future__ import annotations

from os import PathLike, fspath

from mosaic_core.ladder.climb import RULES, climb
from mosaic_core.ladder.shipment import found_shipments

TEST_RESTARTS = 3
"""Enough to see whether each one leaves something; the command restarts a hundred times."""


async def missing_to_gold(
    word: str | PathLike[str], *, restarts: int = TEST_RESTARTS, but_for: tuple[str, ...] = ()
) -> list[str]:
    """One line for each rule that a plugin breaks, or by which it could not be judged, as ``mosaic plugin check WORD
    --level gold`` tells them; none: it is gold.

    ``word``: the name of a distribution or connector type that is installed, or a folder. ``but_for``: the names of
    rules that are not asked. Runs the plugin's code. Raises :class:`MosaicError` (``plugin.not_found``), and
    :class:`TypeError` for what is no name.
    """
    if not isinstance(word, str | PathLike):
        what = f"the class {word.__name__}" if isinstance(word, type) else repr(word)
        cure = "name its distribution, its connector type, or its folder"
        raise TypeError(f"`missing_to_gold` takes the name of a plugin, and not {what}: {cure}")
    (shipment,) = found_shipments([fspath(word)])
    asked = {rule.name for rule in RULES}.difference(but_for)
    return [
        f"{one.subject} {one.rule.name}: {one.verdict} {one.why_not} {[f'{f.place}: {f.message}' for f in one.faults]}"
        async for one in climb(shipment, restarts=restarts, only=asked)
        if one.verdict in ("failed", "not judged")
    ]
