"""Any message as JSON: its schema, its values, and what operators may send."""

from __future__ import annotations

import numpy as np
import pytest
from pydantic import ValidationError

from mosaic_ros2.conversion.json_form import fields_of, model_of, plain
from mosaic_ros2.definitions.definition import Definition, Field, FieldType
from mosaic_ros2.definitions.type_book import TypeBook

BOOK = TypeBook(shares=())


def test_a_message_has_a_schema_by_its_own_names() -> None:
    schema = model_of(BOOK, "std_msgs/msg/Header", is_command=False).model_json_schema(mode="serialization")
    assert list(schema["properties"]) == ["stamp", "frame_id"]


def test_numbers_that_are_not_finite_become_null_and_arrays_lists() -> None:
    message = {"a": np.array([1.5, np.nan], np.float32), "b": float("inf"), "c": [{"d": np.array([1], np.uint8)}]}
    assert plain(message) == {"a": [1.5, None], "b": None, "c": [{"d": [1]}]}


def test_a_command_takes_what_its_fields_can_hold_and_nothing_else() -> None:
    model = model_of(BOOK, "std_msgs/msg/UInt8", is_command=True)
    assert fields_of(model.model_validate({"data": 255})) == {"data": 255}
    assert fields_of(model.model_validate({})) == {"data": 0}
    for wrong in ({"data": 256}, {"data": -1}, {"dato": 1}, {"data": "x"}):
        with pytest.raises(ValidationError):
            model.model_validate(wrong)


def test_a_command_without_a_number_that_is_finite_is_refused() -> None:
    model = model_of(BOOK, "geometry_msgs/msg/Twist", is_command=True)
    with pytest.raises(ValidationError):
        model.model_validate({"linear": {"x": float("nan")}})


def test_arrays_of_a_command_have_their_length() -> None:
    model = model_of(BOOK, "sensor_msgs/msg/Imu", is_command=True)
    assert len(fields_of(model.model_validate({}))["orientation_covariance"]) == 9
    with pytest.raises(ValidationError):
        model.model_validate({"orientation_covariance": [0.0] * 8})


@pytest.mark.parametrize("name", ["copy", "schema", "model_fields", "self", "_x"])
def test_a_field_that_is_named_like_a_part_of_models_keeps_its_name(name: str) -> None:
    book = TypeBook(shares=())
    book.add(Definition("acme/msg/Odd", (Field(name, FieldType("int32")),)))
    model = model_of(book, "acme/msg/Odd", is_command=True)
    assert fields_of(model.model_validate({name: 5})) == {name: 5}
    assert list(model.model_json_schema()["properties"]) == [name]
