"""A valid command is found for any schema that says enough, and where none is, that is said."""

from __future__ import annotations

import json
from typing import Any, ClassVar, Literal

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import Field, TypeAdapter, create_model

from mosaic_core import DataChannelReceivable
from mosaic_core.contract.params import Message
from mosaic_core.drill.commands import NoCommand, example_of, moving_command
from mosaic_core.drill.fields import at, put
from mosaic_core.machines.delivery.framing import PayloadKind
from mosaic_core.runtime.commands.payload import PayloadReader
from mosaic_core.runtime.configuration.receiver_safety import ReceiverSafety
from mosaic_core.words.limits import FieldLimit


class Joint(Message):
    name: Literal["shoulder", "elbow"]
    rate_radps: float = Field(ge=-0.05, le=0.05)


class Arm(Message):
    mode: str = Field(min_length=2)
    count: int = Field(gt=0)
    joint: Joint
    path: list[float] = Field(min_length=2)
    note: str | None = None


class ArmReceiver(DataChannelReceivable[Arm]):
    motion_fields: ClassVar[tuple[str, ...]] = ("joint.rate_radps",)


class Anything(DataChannelReceivable[dict]):  # type: ignore[type-arg]
    pass


class Words(DataChannelReceivable[str]):
    pass


class Coded(Message):
    code: str = Field(pattern="^[A-Z]{3}$")


class CodedReceiver(DataChannelReceivable[Coded]):
    pass


def of(handler: Any, *limits: FieldLimit) -> ReceiverSafety:
    return ReceiverSafety(limits=limits, motion_fields=handler.motion_fields)


def test_a_nested_message_with_bounds_is_made_and_moves_within_them() -> None:
    handler = ArmReceiver("arm")
    command = moving_command(handler, of(handler))
    assert command.moved == "joint.rate_radps"
    value = PayloadReader(handler).read(command.payload())
    assert isinstance(value, Arm)
    assert 0 < value.joint.rate_radps <= 0.05
    assert (value.mode, value.count, value.path) == ("xx", 1, [0, 0])


@pytest.mark.parametrize(
    ("limit", "sign"),
    [
        (FieldLimit(("v",), min=-1, max=1), 1),
        (FieldLimit(("v",), min=0, max=0.02), 1),
        (FieldLimit(("v",), min=-1, max=0), -1),
        (FieldLimit(("v", "w"), max_norm=0.5), 1),
        (FieldLimit(("v",), max=0, min=0), 0),
    ],
)
def test_limits_of_the_file_bound_what_is_tried(limit: FieldLimit, sign: int) -> None:
    handler = Anything("any")
    command = moving_command(handler, of(handler, limit))
    value = at(command.message, "v")
    assert (value > 0) - (value < 0) == sign
    assert abs(value) <= 0.1


def place(*bounds: float | None, norm: float | None = None, rate: float | None = None) -> FieldLimit:
    low, high = bounds
    return FieldLimit(("v",), low, high, norm, max_rate_per_s=rate, kind="position")


@pytest.mark.parametrize(
    ("limit", "value"),
    [
        (place(5, 120), 62.5),
        (place(-90, 90, rate=30), -90),
        (place(-80, 90, rate=30), 90),
        (place(-80, 110, rate=30), 15),
        (place(None, None, rate=30), 15),
        (place(None, 10, rate=30), 10),
        (place(40, None, rate=30), 40),
        (place(-40, None), 1),
        (place(None, None, norm=0.5), 0.25),
    ],
)
def test_a_position_rests_in_its_range_where_a_slew_from_zero_would_be_seen(limit: FieldLimit, value: float) -> None:
    handler = Anything("any")
    command = moving_command(handler, ReceiverSafety(limits=(limit,), position_fields=("v",)))
    assert (at(command.message, "v"), command.fields, command.moved) == (value, (), "v")
    assert at(command.placed(lambda field: 3.0).message, "v") == 3.0
    assert command.placed(lambda field: None) == command


def test_texts_and_messages_of_any_shape_have_commands_too() -> None:
    words = moving_command(Words("w"), of(Words))
    assert (words.kind, words.fields) == (PayloadKind.STRING, ())
    assert moving_command(Anything("a"), of(Anything)).payload() == b"{}"


def test_what_no_value_can_be_made_for_is_said() -> None:
    with pytest.raises(NoCommand, match="must match"):
        moving_command(CodedReceiver("c"), of(CodedReceiver))
    endless = {"$ref": "#/$defs/A", "$defs": {"A": {"$ref": "#/$defs/A"}}}
    with pytest.raises(NoCommand, match="without an end"):
        example_of(endless, endless)


def test_a_field_takes_raw_json_for_what_no_honest_program_sends() -> None:
    handler = ArmReceiver("arm")
    payload = moving_command(handler, of(handler)).with_value("joint.rate_radps", "NaN")
    assert b'"rate_radps": NaN' in payload


@given(st.lists(st.sampled_from("abc"), min_size=1, max_size=3), st.integers(-5, 5))
def test_what_is_put_is_found_again(path: list[str], value: int) -> None:
    message: dict[str, Any] = {"a": 1}
    put(message, ".".join(path), value)
    assert at(message, ".".join(path)) == value
    json.dumps(message)


KINDS: list[Any] = [
    int,
    float,
    bool,
    str,
    list[int],
    dict[str, int],
    int | None,
    tuple[int, str],
    Literal["x", 3],
    Joint,
]


@given(st.lists(st.sampled_from(KINDS), max_size=5))
def test_every_combination_of_types_gives_a_valid_message(kinds: list[Any]) -> None:
    fields: dict[str, Any] = {f"field_{index}": (kind, ...) for index, kind in enumerate(kinds)}
    model = create_model("Made", **fields)
    schema = model.model_json_schema()
    TypeAdapter(model).validate_python(example_of(schema, schema))
