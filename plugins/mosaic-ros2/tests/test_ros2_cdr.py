"""CDR, byte for byte as rosbags has it, for every message that is bundled; and bytes that are none."""

from __future__ import annotations

import struct
from contextlib import suppress
from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rosbags.interfaces import Nodetype
from support.devices.ros_side import STORE, decoded, encoded

from mosaic_ros2.cdr.cursor import CdrError
from mosaic_ros2.cdr.decoding import DTYPES, Decoder
from mosaic_ros2.cdr.encoding import CdrEncoder
from mosaic_ros2.definitions.bundled import bundled
from mosaic_ros2.definitions.type_book import TypeBook

BOOK = TypeBook(shares=())
BOTH = sorted(name for name in bundled() if name in STORE.fielddefs)
CODECS = {name: (CdrEncoder(BOOK, name), Decoder(BOOK, name)) for name in BOTH}
TEXT = st.text(st.characters(exclude_characters="\0", exclude_categories=["Cs"]), max_size=9)


def numbers(base: str) -> st.SearchStrategy[Any]:
    if base == "bool":
        return st.booleans()
    if base.startswith("float"):
        return st.floats(width=int(base[5:]), allow_nan=False)  # type: ignore[arg-type]
    if base in ("octet", "byte"):
        return st.integers(0, 127)  # rosbags takes it for a signed one
    bits = 8 if base == "char" else int("".join(one for one in base if one.isdigit()))
    signed = base.startswith("int")
    return st.integers(-(1 << bits - 1) if signed else 0, (1 << bits - signed) - 1)


def values_of(node: Any) -> st.SearchStrategy[Any]:
    kind, content = node
    if kind is Nodetype.NAME:
        return messages(content)
    if kind is Nodetype.BASE:
        return (
            TEXT.map(lambda text: text[: content[1] // 4] if content[1] else text)
            if content[0] == "string"
            else (numbers(content[0]))
        )
    inner, size = content
    is_array = kind is Nodetype.ARRAY
    most = size if is_array else min(size or 3, 3)
    return st.lists(values_of(inner), min_size=size if is_array else 0, max_size=most)


@cache
def messages(name: str) -> st.SearchStrategy[dict[str, Any]]:
    return st.deferred(lambda: st.fixed_dictionaries({own: values_of(node) for own, node in STORE.fielddefs[name][1]}))


@given(st.data())
def test_every_message_is_encoded_as_rosbags_does_and_read_back(data: st.DataObject) -> None:
    name = data.draw(st.sampled_from(BOTH))
    values = data.draw(messages(name))
    encoder, decoder = CODECS[name]
    ours = encoder.encode(values)
    assert ours == encoded(name, values)
    assert encoder.encode(decoder.decode(ours)) == ours


@pytest.mark.parametrize("name", BOTH)
def test_a_message_of_zeros_is_the_same(name: str) -> None:
    encoder, decoder = CODECS[name]
    assert encoder.encode({}) == encoded(name)
    assert encoder.encode(decoder.decode(encoded(name))) == encoded(name)


@given(st.data())
def test_bytes_that_are_no_message_are_refused_and_nothing_else_happens(data: st.DataObject) -> None:
    name = data.draw(st.sampled_from(BOTH))
    whole = bytearray(CODECS[name][0].encode(data.draw(messages(name))))
    for _ in range(data.draw(st.integers(0, 3))):
        whole[data.draw(st.integers(0, len(whole) - 1))] = data.draw(st.integers(0, 255))
    cut = bytes(whole[: data.draw(st.integers(0, len(whole)))])
    with suppress(CdrError):  # any other error fails the test
        CODECS[name][1].decode(cut)


def test_a_sequence_that_claims_more_than_there_is_takes_no_memory() -> None:
    claim = b"\0\1\0\0" + struct.pack("<IIII", 0, 0, 0, 0xFFFFFFF0)
    for name in ("tf2_msgs/msg/TFMessage", "std_msgs/msg/String"):
        with pytest.raises(CdrError):
            CODECS[name][1].decode(b"\0\1\0\0" + struct.pack("<I", 0xFFFFFFF0))
    with pytest.raises(CdrError, match=r"elements|bytes"):
        CODECS["std_msgs/msg/Float64MultiArray"][1].decode(claim)


def test_big_endian_and_the_plain_form_of_xcdr2_are_read() -> None:
    _, decoder = CODECS["geometry_msgs/msg/Point"]
    assert decoder.decode(b"\0\0\0\0" + struct.pack(">ddd", 1, 2, 3)) == {"x": 1.0, "y": 2.0, "z": 3.0}
    _, decoder = CODECS["std_msgs/msg/Float64MultiArray"]
    body = struct.pack("<III", 0, 0, 1) + struct.pack("<d", 2.5)
    assert decoder.decode(b"\0\7\0\0" + body)["data"].tolist() == [2.5]
    with pytest.raises(CdrError, match="name no plain CDR"):
        decoder.decode(b"\0\3\0\0" + body)


def test_arrays_look_at_the_bytes_of_the_message() -> None:
    data = encoded("sensor_msgs/msg/Image", {"data": np.arange(100, dtype=np.uint8)})
    pixels = CODECS["sensor_msgs/msg/Image"][1].decode(data)["data"]
    assert np.shares_memory(pixels, np.frombuffer(data, np.uint8))


@pytest.mark.parametrize(
    ("name", "values", "reason"),
    [
        ("std_msgs/msg/UInt8", {"data": 256}, "data: "),
        ("std_msgs/msg/UInt8", {"dato": 1}, "did you mean 'data'"),
        ("std_msgs/msg/UInt8MultiArray", {"data": [1.5]}, "no uint8 can hold"),
        ("std_msgs/msg/String", {"data": 7}, "text is expected"),
        ("std_msgs/msg/String", {"data": "a\0b"}, "zero in it"),
        ("sensor_msgs/msg/Imu", {"orientation_covariance": [1, 2]}, "2 elements where 9"),
        ("geometry_msgs/msg/Twist", {"linear": 3}, "linear: 3 where geometry_msgs/msg/Vector3"),
        ("geometry_msgs/msg/Twist", {"linear": {"x": "fast"}}, "linear: x: "),
    ],
)
def test_a_value_that_its_type_can_not_hold_is_named_by_its_path(name: str, values: Any, reason: str) -> None:
    with pytest.raises(CdrError, match=reason):
        CdrEncoder(BOOK, name).encode(values)


def test_every_number_has_a_form() -> None:
    assert decoded("std_msgs/msg/Float32", encoded("std_msgs/msg/Float32", {"data": 0.5})).data == 0.5
    assert len(DTYPES) == 13
