"""Registers to numbers and back, and the plan of requests: whatever the fields are, nothing is lost or overwritten."""

from __future__ import annotations

import struct
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_modbus.numbers import LARGEST_FLOAT32, bounds, decoded, encoded, is_whole, width
from mosaic_modbus.params import ModbusLineParams, RegisterField, WriteField
from mosaic_modbus.plan import MAX_READ, MAX_WRITE, overlap, read_plan, writes_of

TYPES = ["int16", "uint16", "int32", "uint32", "int64", "uint64", "float32", "float64"]
ORDERS = st.sampled_from(["big", "little"])
FIELDS = st.builds(
    lambda address, kind, kind_type: RegisterField(
        address=address, kind=kind, type=kind_type if kind in ("holding", "input") else None
    ),
    st.integers(0, 300), st.sampled_from(["holding", "input", "coil", "discrete"]), st.sampled_from(TYPES),
)  # fmt: skip


@pytest.mark.parametrize(
    ("params", "words", "value"),
    [
        ({}, [0xFFFE], 65534),
        ({"type": "int16"}, [0xFFFE], -2),
        ({"type": "int16", "byte_order": "little"}, [0xFEFF], -2),
        ({"type": "int32"}, [0xFFFF, 0xFFFE], -2),
        ({"type": "uint32", "word_order": "little"}, [0x5678, 0x1234], 0x12345678),
        ({"type": "uint32", "byte_order": "little"}, [0x3412, 0x7856], 0x12345678),
        ({"type": "uint32", "byte_order": "little", "word_order": "little"}, [0x7856, 0x3412], 0x12345678),
        ({"type": "float32"}, [0x3FC0, 0x0000], 1.5),
        ({"type": "float32", "word_order": "little"}, [0x0000, 0x3FC0], 1.5),
        ({"type": "float32"}, [0x7FC0, 0x0000], None),
        ({"type": "float64"}, [0x3FF8, 0, 0, 0], 1.5),
        ({"type": "uint64"}, [0xFFFF] * 4, 2**64 - 1),
        ({"scale": 0.1, "offset": -40}, [500], 10.0),
        ({"scale": 10, "offset": 5}, [3], 35),
        ({"bit": 3}, [0x0008], True),
        ({"bit": 15}, [0x8000], True),
        ({"bit": 15, "byte_order": "little"}, [0x0080], True),
        ({"bit": 0}, [0xFFFE], False),
        ({"kind": "coil"}, [1], True),
        ({"kind": "discrete"}, [0], False),
    ],
)
def test_a_field_is_read_as_its_manual_says(params: dict[str, Any], words: list[int], value: Any) -> None:
    field = RegisterField(address=0, **params)
    assert width(field) == len(words)
    assert decoded(field, words) == value


@given(kind=st.sampled_from(TYPES), words=ORDERS, within=ORDERS, share=st.floats(0, 1))
def test_what_is_written_is_read_again(kind: Any, words: Any, within: Any, share: float) -> None:
    field = WriteField(
        address=0, type=kind, word_order=words, byte_order=within, scale=0.5, offset=3, min=-1000, max=50_000
    )
    low, high = bounds(field)
    value = low + share * (high - low)
    back = decoded(field, encoded(field, value))
    assert back == pytest.approx(value, abs=0.25 if "int" in kind else 1e-2)


@given(kind=st.sampled_from(TYPES), scale=st.sampled_from([1.0, -1.0, 0.1, 0.001, 7.3, 1e-6]), end=st.booleans())
def test_the_ends_of_the_range_can_be_written(kind: Any, scale: float, end: bool) -> None:
    field = WriteField(address=0, type=kind, scale=scale, offset=0.3)
    value = bounds(field)[end]
    assert decoded(field, encoded(field, value)) == pytest.approx(value, rel=1e-6)


@pytest.mark.parametrize("value", [-0.1, 101.0, float("nan"), float("inf")])
def test_what_lies_beyond_the_bounds_is_no_register(value: float) -> None:
    with pytest.raises(ValueError, match="not within 0 to 100"):
        encoded(WriteField(address=0, min=0, max=100), value)


def test_bounds_are_those_of_the_file_and_of_the_register() -> None:
    assert bounds(WriteField(address=0, min=-5, max=1e6)) == (0, 65535)
    assert bounds(WriteField(address=0, type="int16", scale=-0.1)) == pytest.approx((-3276.7, 3276.8))
    assert bounds(WriteField(address=0, type="float32")) == (-LARGEST_FLOAT32, LARGEST_FLOAT32)
    struct.pack(">f", LARGEST_FLOAT32)


def test_numbers_are_whole_where_all_of_them_are() -> None:
    assert is_whole(RegisterField(address=0, scale=10))
    assert not is_whole(RegisterField(address=0, scale=0.5))
    assert not is_whole(RegisterField(address=0, type="float32"))


# -- the plan ----------------------------------------------------------------------------------------------------


@given(st.dictionaries(st.text("abc", min_size=1), FIELDS, min_size=1, max_size=40), st.integers(0, 10))
def test_every_field_lies_in_one_block_that_a_request_can_ask_for(fields: dict[str, RegisterField], gap: int) -> None:
    blocks = read_plan(fields, gap)
    assert sorted(name for one in blocks for name in one.names) == sorted(fields)
    for one in blocks:
        assert one.count <= MAX_READ[one.kind]
        asked = {at for name in one.names for at in _places(fields[name])}
        assert asked <= set(range(one.address, one.address + one.count))
        if gap == 0:
            assert len(asked) == one.count
        for name in one.names:
            words = one.words_of(fields[name], range(one.address, one.address + one.count))
            assert list(words) == _places(fields[name])


def _places(field: RegisterField) -> list[int]:
    return list(range(field.address, field.address + width(field)))


def test_neighbours_are_one_request_and_gaps_only_where_that_is_allowed() -> None:
    fields = {
        "a": RegisterField(address=10, type="float32"), "b": RegisterField(address=12), "c": RegisterField(address=15),
        "d": RegisterField(address=16, kind="input"),
    }  # fmt: skip
    assert [str(one) for one in read_plan(fields)] == ["holding 10 to 12", "holding 15", "input 16"]
    assert [str(one) for one in read_plan(fields, 2)] == ["holding 10 to 15", "input 16"]


@given(st.sets(st.integers(0, 400), min_size=1, max_size=300), st.sampled_from(["holding", "coil"]))
def test_writes_say_each_value_once_and_touch_nothing_else(addresses: set[int], kind: Any) -> None:
    fields = {f"f{at}": WriteField(address=at, kind=kind) for at in addresses}
    writes = list(writes_of(fields, {name: [one.address % 2] for name, one in fields.items()}))
    said = [(one.address + at, word) for one in writes for at, word in enumerate(one.words)]
    assert said == [(at, at % 2) for at in sorted(addresses)]
    assert all(len(one.words) <= MAX_WRITE[kind] for one in writes)


@given(st.lists(st.tuples(st.integers(0, 30), st.sampled_from(TYPES)), min_size=2, max_size=6))
def test_two_fields_in_one_register_are_found(places: list[tuple[int, Any]]) -> None:
    fields = {f"f{number}": WriteField(address=at, type=kind) for number, (at, kind) in enumerate(places)}
    sets = [set(_places(one)) for one in fields.values()]
    is_apart = sum(map(len, sets)) == len(set().union(*sets))
    assert (overlap(fields) is None) == is_apart


# -- what can't be meant -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("params", "said"),
    [
        ({"kind": "coil", "type": "int16"}, "leave `type` and `bit` out"),
        ({"kind": "discrete", "bit": 1}, "leave `type` and `bit` out"),
        ({"type": "boolean"}, "needs its `bit`"),
        ({"type": "int16", "bit": 2}, "a bit is a boolean"),
        ({"bit": 2, "scale": 2}, "no scale"),
        ({"scale": 0}, "scale: 0"),
    ],
)
def test_a_field_that_cannot_be_read_is_refused(params: dict[str, Any], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        RegisterField(address=0, **params)


@pytest.mark.parametrize(
    ("params", "said"),
    [
        ({"bit": 1}, "single bit"),
        ({"kind": "coil", "max": 1}, "a coil has no motion"),
        ({"motion": "position"}, "needs `safe`"),
        ({"kind": "input"}, "holding"),
    ],
)
def test_a_field_that_cannot_be_written_is_refused(params: dict[str, Any], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        WriteField(address=0, **params)


@pytest.mark.parametrize("source", ["udp://host:1", "tcp://", "tcp://host:0", "tcp://host:x", "ttyUSB0", "tcp://h:1/x"])
def test_a_line_that_is_none_is_refused(source: str) -> None:
    with pytest.raises(ValueError, match=r"line|[Pp]ort"):
        ModbusLineParams(source=source)


@pytest.mark.parametrize("source", ["tcp://plc", "tcp://[::1]:1502", "rtu+tcp://10.0.0.1:4001", "/dev/ttyS0", "COM3"])
def test_a_line_that_is_one_is_taken(source: str) -> None:
    assert ModbusLineParams(source=source).source == source
