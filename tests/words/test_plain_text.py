"""What people chose to be called or to say reaches nobody's terminal or page as anything but text."""

from __future__ import annotations

import json
import unicodedata

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.words.control import Bye, Hello, LeaseRequest, Stop, parse_control
from mosaic_core.words.plain_text import plain
from mosaic_core.words.signaling import OperatorIdentity

TURNS = {"LRE", "RLE", "LRO", "RLO", "PDF", "LRI", "RLI", "FSI", "PDI"}
EVIL = "Ann\x1b[2J\r\nERROR robot \u202eevil\u2028\x9b31m\x07"
CALM = "Ann\ufffd[2J  ERROR robot \ufffdevil \ufffd31m\ufffd"


@given(st.text())
def test_no_control_character_mark_of_direction_or_end_of_line_is_left(text: str) -> None:
    shown = plain(text)
    assert not [one for one in shown if unicodedata.category(one) in ("Cc", "Zl", "Zp")]
    assert not [
        one
        for one in shown
        if unicodedata.bidirectional(one) in ("LRE", "RLE", "LRO", "RLO", "PDF", "LRI", "RLI", "FSI", "PDI")
    ]
    assert len(shown) <= len(text)
    assert len(shown.splitlines()) <= 1
    assert plain(shown) == shown


HIDDEN = {
    "a tag": "\U000e0041",
    "a selector of variants": "\U000e0100",
    "a musical control": "\U0001d173",
    "a joiner of graphemes": "\u034f",
    "a letter without a shape": "\u3164",
    "an unassigned one that is ignored": "\U000e0fff",
    "an end of annotation": "\ufff8",
    "an old selector": "\ufe00",
    "a soft hyphen": "\u00ad",
}


@pytest.mark.parametrize("hidden", HIDDEN.values(), ids=HIDDEN)
def test_a_name_carries_nothing_that_is_not_seen(hidden: str) -> None:
    assert plain(f"An{hidden}na{hidden * 3}") == "Anna"


@pytest.mark.parametrize("name", ["👩🏽\u200d🔧 ❤\ufe0f", "می\u200cخواهم", "क्\u200dष", "葛飾", "ルンバ 3"])
def test_joiners_stay_that_writing_needs(name: str) -> None:
    assert plain(name) == name


SHAPELESS = "\u115f\u1160\u3164\uffa0"
"""Letters without a shape, in Korean."""


@given(st.text(st.characters(categories=["L", "N", "P", "S", "Zs"], exclude_characters=f"\ufffd{SHAPELESS}")))
def test_letters_of_every_language_stay(text: str) -> None:
    assert plain(text) == text


@pytest.mark.parametrize(
    ("message", "field"),
    [
        ({"type": "bye", "data": {"code": "peer.closed", "message": EVIL}}, "message"),
        ({"type": "bye", "data": {"code": EVIL}}, "code"),
        ({"type": "hello", "data": {"software": EVIL, "bootId": "b"}}, "software"),
        ({"type": "stop", "data": {"id": "s", "reason": EVIL}}, "reason"),
        ({"type": "lease.request", "data": {"reason": EVIL}}, "reason"),
    ],
)
def test_what_an_operator_says_is_plain_when_it_is_read(message: dict[str, object], field: str) -> None:
    heard = parse_control(json.dumps(message))
    assert isinstance(heard, Bye | Hello | Stop | LeaseRequest)
    assert getattr(heard, field) == CALM


def test_the_name_of_an_account_is_plain() -> None:
    assert OperatorIdentity(id="a", name=EVIL).name == CALM
