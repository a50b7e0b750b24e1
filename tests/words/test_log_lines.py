"""What a stranger chose can't forge a line of the log, nor speak to the terminal."""

from __future__ import annotations

import io
import json
import logging
import unicodedata

from hypothesis import example, given
from hypothesis import strategies as st

from mosaic_core.cli.terminal.log_output import JsonLines
from mosaic_core.words.log_lines import TextLines
from mosaic_core.words.plain_text import on_one_line

FORGED = "bob\n12:00:00 INFO    ann holds the lease\x1b[2J\x9b1m\u202e"
ACTING = {"Cc", "Zl", "Zp"}
TURNING = {"LRE", "RLE", "PDF", "LRO", "RLO", "LRI", "RLI", "FSI", "PDI"}


def logged(formatter: logging.Formatter, name: str, error: Exception | None = None) -> str:
    """One line that names somebody, as it is written."""
    stream = io.StringIO()
    handler = logging.StreamHandler(stream)
    handler.setFormatter(formatter)
    exc_info = (type(error), error, None) if error else None
    handler.handle(logging.LogRecord("robot", logging.INFO, "", 0, "%s left", (name,), exc_info))  # type: ignore[arg-type]
    return stream.getvalue()


@given(st.text())
@example(FORGED)
def test_no_character_that_acts_is_left(text: str) -> None:
    shown = on_one_line(text)
    assert not [
        char for char in shown if unicodedata.category(char) in ACTING or unicodedata.bidirectional(char) in BIDI
    ]


BIDI = {"LRE", "RLE", "PDF", "LRO", "RLO", "LRI", "RLI", "FSI", "PDI"}


@given(st.text(st.characters(categories=("L", "N", "P", "S", "Zs"), exclude_characters="\u115f\u1160\u3164\uffa0")))
def test_what_people_write_stays_as_it_is(text: str) -> None:
    assert on_one_line(text) == text


def test_a_name_makes_no_second_line() -> None:
    line = logged(TextLines("%(levelname)s %(message)s"), FORGED)
    assert line == r"INFO bob\u000a12:00:00 INFO    ann holds the lease\u001b[2J\u009b1m\u202e left" + "\n"


def test_what_is_not_seen_is_told() -> None:
    assert logged(TextLines("%(message)s"), "bob\u200b\U000e0041") == r"bob\u200b\udb40\udc41 left" + "\n"


def test_a_traceback_stands_below_its_line_and_what_it_quotes_begins_none() -> None:
    first, *below = logged(TextLines("%(message)s"), "bob", ValueError("x\nann left")).splitlines()
    assert first == "bob left"
    assert below == ["    ValueError: x", "    ann left"]


def test_an_object_of_json_reads_as_it_was_said_and_shows_no_control_character() -> None:
    name = f"{FORGED}\U000e0041"
    line = logged(JsonLines(), name)
    assert json.loads(line)["message"] == f"{name} left"
    assert line.rstrip("\n").isprintable()
