"""What counts as a Twist on the wire, and what is refused."""

from __future__ import annotations

import json
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from mosaic_core.messages import AngularVelocity, LinearVelocity, Twist


def read(text: str) -> Twist:
    return Twist.model_validate(json.loads(text))


def test_the_message_of_the_original_pads_is_read() -> None:
    text = '{"linear":{"x":1,"y":0,"z":0},"angular":{"x":0,"y":0,"z":-1}}'

    assert read(text) == Twist(linear=LinearVelocity(x=1.0), angular=AngularVelocity(z=-1.0))


@pytest.mark.parametrize(
    ("text", "twist"),
    [
        ('{"linear":{"x":0.5}}', Twist(linear=LinearVelocity(x=0.5))),
        ('{"angular":{"z":0.5}}', Twist(angular=AngularVelocity(z=0.5))),
        ('{"linear":{},"angular":{}}', Twist(linear=LinearVelocity())),
        ('{"linear":{"y":-2},"header":{"frame_id":"base_link"}}', Twist(linear=LinearVelocity(y=-2.0))),
    ],
)
def test_absent_components_are_zero_and_foreign_keys_are_ignored(text: str, twist: Twist) -> None:
    assert read(text) == twist


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("{}", "needs linear or angular, has neither"),
        ('{"lineer":{"x":1}}', "needs linear or angular, has lineer"),
        ('{"linear_x":1,"angular_z":0}', "has linear_x, angular_z"),
        ('{"linear":{"X":1}}', "needs x, y or z, has only X"),
        ('{"linear":null}', "linear"),
        ('{"linear":[1,0,0]}', "linear"),
        ('{"linear":{"x":"1"}}', "valid number"),
        ('{"linear":{"x":true}}', "valid number"),
        ('{"linear":{"x":null}}', "valid number"),
        ('{"linear":{"x":NaN}}', "finite"),
        ('{"angular":{"z":Infinity}}', "finite"),
        ('{"angular":{"z":-1e999}}', "finite"),
        ('{"linear":{"x":1' + "0" * 400 + "}}", "valid number"),
        ("[1]", "Twist"),
        ('"forward"', "Twist"),
        ("null", "Twist"),
    ],
)
def test_what_is_no_velocity_is_refused_and_says_why(text: str, says: str) -> None:
    with pytest.raises(ValidationError, match=says):
        read(text)


@given(st.recursive(st.none() | st.booleans() | st.floats() | st.integers() | st.text(), lambda inner: (
    st.lists(inner, max_size=3) | st.dictionaries(st.sampled_from(["linear", "angular", "x", "y", "z", "w"]), inner)
), max_leaves=12))  # fmt: skip
def test_any_json_is_either_finite_or_refused(value: object) -> None:
    try:
        twist = Twist.model_validate(value)
    except ValidationError:
        return
    parts = (twist.linear, twist.angular)
    assert all(math.isfinite(number) for part in parts for number in (part.x, part.y, part.z))


def test_the_schema_tells_units_to_widgets() -> None:
    schema = Twist.model_json_schema()

    assert schema["$defs"]["LinearVelocity"]["properties"]["x"]["unit"] == "m/s"
    assert schema["$defs"]["AngularVelocity"]["properties"]["z"]["unit"] == "rad/s"
