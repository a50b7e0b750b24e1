"""What a model found wrong, in words for a message: which fields, and what of each."""

from __future__ import annotations

from typing import Any

import pytest
from pydantic import BaseModel, ValidationError

from mosaic_core.words.wire_model import told_mistakes, wrong_fields


class Place(BaseModel):
    x_m: float
    y_m: float


class Trip(BaseModel):
    name: str
    ends: Place


@pytest.mark.parametrize(
    ("said", "fields", "told"),
    [
        ("here", "data", "Input should be a valid dictionary or instance of Trip"),
        ({"name": "a", "ends": {"x_m": 1, "y_m": "far"}}, "ends.y_m",
         "ends.y_m: Input should be a valid number, unable to parse string as a number"),
        ({"ends": {}}, "name, ends.x_m, ends.y_m", "name: Field required; ends.x_m: Field required"),
    ],
)  # fmt: skip
def test_the_first_mistakes_are_told_behind_their_fields_without_what_was_said(
    said: Any, fields: str, told: str
) -> None:
    with pytest.raises(ValidationError) as caught:
        Trip.model_validate(said)
    assert wrong_fields(caught.value) == fields
    assert told_mistakes(caught.value, most=2) == told
