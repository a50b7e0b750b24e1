"""JSON Pointers find what RFC 6901 says."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_host.web.pointer import checked_pointer, part_of

RFC = {
    "foo": ["bar", "baz"], "": 0, "a/b": 1, "c%d": 2, "e^f": 3, "g|h": 4, "i\\j": 5, 'k"l': 6, " ": 7, "m~n": 8,
}  # fmt: skip


@pytest.mark.parametrize(
    ("pointer", "part"),
    [
        ("", RFC), ("/foo", ["bar", "baz"]), ("/foo/0", "bar"), ("/", 0), ("/a~1b", 1), ("/c%d", 2), ("/e^f", 3),
        ("/g|h", 4), ("/i\\j", 5), ('/k"l', 6), ("/ ", 7), ("/m~0n", 8),
    ],
)  # fmt: skip
def test_the_examples_of_the_rfc_hold(pointer: str, part: Any) -> None:
    assert part_of(RFC, checked_pointer(pointer)) == part


@pytest.mark.parametrize(
    "pointer", ["/foo/2", "/foo/01", "/foo/-", "/foo/-1", "/foo/bar", "/none", "/foo/0/x", "/foo/²"]
)
def test_what_is_not_there_is_told_with_its_pointer(pointer: str) -> None:
    with pytest.raises(LookupError, match="nothing is at"):
        part_of(RFC, pointer)


@pytest.mark.parametrize("pointer", ["foo", "/a~", "/a~2b"])
def test_what_is_no_pointer_is_refused(pointer: str) -> None:
    with pytest.raises(ValueError, match="no JSON Pointer"):
        checked_pointer(pointer)


@given(st.dictionaries(st.text(max_size=8), st.integers(), min_size=1, max_size=5))
def test_every_key_has_a_pointer(value: dict[str, int]) -> None:
    for key, number in value.items():
        pointer = "/" + key.replace("~", "~0").replace("/", "~1")
        assert part_of(value, checked_pointer(pointer)) == number
