"""The page on safety tells the way of a command as the admission module goes it: order, names, codes and cures."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from mosaic_core.machines.commands.admission import WAY
from mosaic_core.words.codes import reason

PAGE = Path(__file__).parents[2] / "docs" / "topics" / "safety.md"
HEAD = "| asked when it | gate | question | what is refused, and what to do |"


def the_table() -> Iterator[str]:
    """A row per gate; the cure of a code stands where it is told first."""
    yield HEAD
    yield "|---|---|---|---|"
    told: set[str] = set()
    for moment, rule in WAY:
        codes = [f"`{code}`" if code in told else f"`{code}`: {reason(code).cure}" for code in rule.codes]
        told.update(rule.codes)
        refused = "<br>".join(codes) or "nothing; it slows down"
        where = f" ({rule.where})" if rule.where else ""
        yield f"| {moment} | `{rule.gate}` | {rule.question}{where} | {refused} |"


def test_the_table_on_the_page_is_the_way_of_the_module() -> None:
    lines = PAGE.read_text(encoding="utf-8").splitlines()
    start = lines.index(HEAD)
    on_the_page = lines[start : lines.index("", start)]
    assert on_the_page == list(the_table())


def test_every_gate_has_a_place() -> None:
    from mosaic_core.machines.commands.gates import Gate

    assert {rule.gate for _, rule in WAY} == set(Gate)


def test_every_refusal_has_a_cure() -> None:
    for _, rule in WAY:
        for code in rule.codes:
            assert reason(code).cure, f"{code} of the gate {rule.gate} says nothing of what to do"
