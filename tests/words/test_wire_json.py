"""What is read of foreign JSON can be sent on."""

from __future__ import annotations

import json
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.words.wire_model import MAX_DEPTH, parsed_object, parsed_value, to_json


@given(st.binary(max_size=200) | st.recursive(
    st.none() | st.booleans() | st.floats() | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=10,
).map(lambda value: json.dumps(value).encode()))  # fmt: skip
def test_whatever_is_taken_can_be_sent(data: bytes) -> None:
    try:
        value = parsed_value(data)
    except ValueError:
        return
    assert to_json(value).encode()


def nested(depth: int) -> bytes:
    return b"[" * depth + b"]" * depth


def test_it_may_be_nested_as_deeply_as_the_bound_says() -> None:
    assert parsed_value(nested(MAX_DEPTH)) is not None
    for depth in (MAX_DEPTH + 1, 100_000):
        with pytest.raises(ValueError, match="nested deeper than 32"):
            parsed_value(nested(depth))


@pytest.mark.parametrize("data", [b"NaN", b'{"v": Infinity}', b'"\\ud800"', b"{", b"\xff"])
def test_what_no_operator_could_read_is_refused(data: bytes) -> None:
    with pytest.raises(ValueError):  # noqa: PT011 - of json, of Unicode, of the encoder
        parsed_value(data)


@pytest.mark.parametrize(("data", "kind"), [(b"[1]", "list"), (b"3", "int"), (b"null", "NoneType")])
def test_an_object_is_told_from_other_values(data: bytes, kind: str) -> None:
    with pytest.raises(ValueError, match=f"a JSON {kind} where an object is expected"):
        parsed_object(data)


def test_an_object_is_read_as_it_is() -> None:
    expected: dict[str, Any] = {"a": [1, 2.5, None, True], "b": {"c": "ü"}}
    assert parsed_object(json.dumps(expected).encode()) == expected
