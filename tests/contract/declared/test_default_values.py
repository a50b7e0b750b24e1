"""A default that its own field would not take is told when the class is made, with its class, field, line and cure."""

from __future__ import annotations

import math
import re
from enum import Enum
from pathlib import Path
from typing import Any, Literal

import pytest
from pydantic import Field, ValidationInfo, field_validator, model_validator

from mosaic_core import Message, Params, unit
from mosaic_core.contract.params import CameraLabel
from mosaic_core.words.errors import MosaicError


class Colour(Enum):
    RED = "red"


class Inner(Params):
    port: int = 1


def made(base: type, annotation: Any, default: Any) -> Any:
    return type("It", (base,), {"__annotations__": {"speed": annotation}, "speed": default, "__module__": __name__})


def told(base: type, annotation: Any, default: Any) -> str:
    with pytest.raises(MosaicError) as refused:
        made(base, annotation, default)
    assert refused.value.code == "config.broken_plugin"
    place, _, rest = str(refused.value).partition(": It: ")
    assert place.startswith(f"{__file__}:")
    words, _, cure = rest.partition(". ")
    assert cure.endswith("Correct the default of 'speed', or the type of the field.")
    return words


@pytest.mark.parametrize("base", [Params, Message])
@pytest.mark.parametrize(
    ("annotation", "default", "words"),
    [
        (float, "fast", "'fast'; expected a number"),
        (float, "3", "'3'; expected a number"),
        (float, "${SPEED}", "'${SPEED}'; expected a number"),
        (int, 1.5, "1.5; expected a whole number"),
        (bool, "yes", "'yes'; expected true or false"),
        (float, None, "None; expected a number"),
        (float, math.nan, "nan; expected a finite number"),
        (float, math.inf, "inf; expected a finite number"),
        (float, Field(default=-1.0, gt=0), "-1.0; expected a number > 0"),
        (float, Field(default=-1.0, gt=0, alias="v"), "-1.0; expected a number > 0"),
        (Literal["slow", "quick"], "slwo", "'slwo'; expected 'slow' or 'quick'"),
        (tuple[float, ...], ("a",), "('a',); expected a number"),
        (dict[str, float], {"a": "1"}, "{'a': '1'}; expected a number"),
        (Path, "here", "'here'; expected an instance of Path"),
        (Colour, "red", "'red'; expected an instance of Colour"),
        (Inner, {"prot": 1}, "{'prot': 1}; Extra inputs are not permitted"),
    ],
)
def test_a_default_that_the_field_would_not_take_is_refused(
    base: type, annotation: Any, default: Any, words: str
) -> None:
    assert told(base, annotation, default) == f"the default of its field 'speed' is {words}"


@pytest.mark.parametrize("base", [Params, Message])
@pytest.mark.parametrize(
    ("annotation", "default"),
    [
        (float, 1),
        (float | None, None),
        (tuple[float, ...], [1.0]),
        (Inner, Inner(port=2)),
        (CameraLabel, "front"),
        (str, "${HOST}"),
        (Any, "anything"),
        (Path, Path("here")),
        (float, Field(default_factory=lambda: pytest.fail("nobody asks for it"))),
        (float, ...),
    ],
)
def test_a_default_that_the_field_takes_is_none_of_our_business(base: Any, annotation: Any, default: Any) -> None:
    assert "speed" in made(base, annotation, default).model_fields


def test_the_line_is_that_of_the_class_and_the_nearest_word_is_named() -> None:
    def make() -> None:
        class Pace(Params):
            speed: Literal["slow", "quick"] = "slwo"

    with pytest.raises(MosaicError) as refused:
        make()
    assert str(refused.value).startswith(
        f"{__file__}:{make.__code__.co_firstlineno + 1}: {make.__qualname__}.<locals>.P"
    )
    assert "did you mean 'slow'? Correct the default of 'speed'" in str(refused.value)


def test_a_misspelt_word_of_a_field_is_refused_and_one_of_the_schema_is_not() -> None:
    words: dict[str, Any] = {"defualt": 320}
    with pytest.warns(DeprecationWarning, match="extra keyword arguments"):
        field = Field(**words)
    with pytest.raises(MosaicError, match=r"'defualt', which nothing reads; did you mean 'default'\?"):
        made(Params, int, field)
    assert "speed" in made(Params, int, Field(default=3, json_schema_extra={"unit": "px"})).model_fields


@pytest.mark.parametrize(
    ("extra", "told"),
    [
        ("ppm", """has json_schema_extra='ppm', which nothing reads. Write json_schema_extra=unit("ppm")"""),
        (unit, """has json_schema_extra=unit, which nothing reads. Write json_schema_extra=unit("V")"""),
        (["V"], "has json_schema_extra=['V'], which nothing reads."),
        ({"units": "V"}, "has 'units', which nothing reads; did you mean 'unit'?"),
    ],
)
def test_a_unit_that_stands_where_nothing_reads_it_is_refused(extra: Any, told: str) -> None:
    with pytest.raises(MosaicError, match=re.escape(f"Field of 'speed' {told}")):
        made(Message, float, Field(default=1.0, json_schema_extra=extra))


def test_what_a_measured_number_may_be_a_default_may_be() -> None:
    assert "speed" in made(Message, float | None, math.nan).model_fields


def test_validators_of_ones_own_are_for_what_somebody_writes() -> None:
    class Own(Params):
        url: str = ""
        low: float = 2.0
        high: float
        most: float = 3.0

        @field_validator("url")
        @classmethod
        def _is_a_url(cls, value: str) -> str:
            if not value.startswith("http"):
                raise ValueError("no URL")
            return value

        @field_validator("most")
        @classmethod
        def _above(cls, value: float, info: ValidationInfo) -> float:
            return max(value, info.data["high"])

        @model_validator(mode="before")
        @classmethod
        def _whole(cls, data: Any) -> Any:
            return data

    assert Own(high=4.0).url == ""
