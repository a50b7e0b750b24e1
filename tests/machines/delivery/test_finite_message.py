"""Numbers that JSON does not know become null where they may be absent, and are named where they may not."""

from __future__ import annotations

import json
import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import BaseModel

from mosaic_core.machines.delivery.finite_message import finite


class Point(BaseModel):
    x: float
    y: float | None = None


class Scan(BaseModel):
    ranges: list[float | None]
    sure: list[float] = []
    at: Point | None = None
    places: dict[str, Point] = {}
    anything: Any = None
    pair: tuple[float, float | None] = (0.0, None)


SCHEMA = Scan.model_json_schema(mode="serialization")
NAN, INF = math.nan, math.inf


@pytest.mark.parametrize(
    ("value", "told", "refused"),
    [
        ({"ranges": [1.0, NAN, -INF]}, {"ranges": [1.0, None, None]}, ()),
        ({"ranges": [], "sure": [NAN, INF]}, None, ("sure[]",)),
        ({"at": {"x": 1.0, "y": NAN}}, {"at": {"x": 1.0, "y": None}}, ()),
        ({"at": {"x": NAN, "y": NAN}}, None, ("at.x",)),
        ({"places": {"home": {"x": INF}}}, None, ("places.home.x",)),
        ({"anything": NAN}, {"anything": None}, ()),
        ({"unknown": NAN}, None, ("unknown",)),
        (NAN, None, ("message",)),
    ],
)
def test_a_declared_message(value: Any, told: Any, refused: tuple[str, ...]) -> None:
    found, wrong = finite(value, SCHEMA)
    assert wrong == refused
    if not refused:
        assert found == told


def test_where_nothing_is_declared_nothing_may_be_absent() -> None:
    assert finite({"a": [NAN]}, None)[1] == ("a[]",)


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=3),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.sampled_from(["ranges", "at", "x", "y"]), inner),
    max_leaves=12,
)


@given(JSON, st.sampled_from([SCHEMA, None]))
def test_whatever_is_sent_the_rest_is_json_and_finite_numbers_stay(value: Any, schema: dict[str, Any] | None) -> None:
    found, refused = finite(value, schema)
    text = json.dumps(found, allow_nan=False)
    try:
        json.dumps(value, allow_nan=False)
    except ValueError:
        assert refused or "null" in text
    else:
        assert (found, refused) == (value, ())


def test_each_place_of_a_tuple_has_a_schema_of_its_own() -> None:
    number, absent = {"type": "number"}, {"anyOf": [{"type": "number"}, {"type": "null"}]}
    either = {"anyOf": [{"prefixItems": [number, absent], "items": number}, {"prefixItems": [number, number, absent]}]}
    schema = {"properties": {"t": either}}
    assert finite({"t": (1.0, math.nan, math.nan)}, schema) == ({"t": [1.0, None, None]}, ())
    assert finite({"t": (math.nan, 1.0)}, schema) == ({"t": [None, 1.0]}, ("t[]",))
    assert finite({"t": (1.0, 1.0, 1.0, math.nan)}, schema) == ({"t": [1.0, 1.0, 1.0, None]}, ("t[]",))
