"""A class that gives its base a wrong number of types, or a configurer none, is told with class, line and cure."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any, TypeVar

import pytest

from mosaic_core import (
    DataChannelConfigurer,
    DataChannelReceivable,
    DataChannelSendable,
    MediaTrackHandler,
    Message,
    MosaicError,
    NoParams,
    Params,
    RequestHandler,
)

P = TypeVar("P", bound=Params)


class Question(Message):
    name: str = ""


def bare_configurer() -> None:
    class Mine(DataChannelConfigurer):  # type: ignore[type-arg]
        def configure(self) -> Any:
            return self.params.port


def two_params() -> None:
    class Mine(DataChannelConfigurer[NoParams, NoParams]): ...  # type: ignore[type-arg]


def question_alone() -> None:
    class Mine(RequestHandler[Question]): ...  # type: ignore[type-arg]


def two_messages() -> None:
    class Mine(DataChannelSendable[Question, Question]): ...  # type: ignore[type-arg]


def picture_type() -> None:
    class Mine(MediaTrackHandler[Question]): ...  # type: ignore[type-arg]


@pytest.mark.parametrize(
    ("make", "message", "cure"),
    [
        (
            bare_configurer,
            "it reads its params, and does not say what they are.",
            "Write `DataChannelConfigurer[YourParams]`.",
        ),
        (
            two_params,
            "it gives DataChannelConfigurer 2 types instead of 1.",
            "Write `DataChannelConfigurer[YourParams]`.",
        ),
        (
            question_alone,
            "it gives RequestHandler 1 type instead of 2.",
            "Write `RequestHandler[YourQuestion, YourAnswer]`.",
        ),
        (
            two_messages,
            "it gives DataChannelSendable 2 types instead of 1.",
            "Write `DataChannelSendable[YourMessage]`.",
        ),
        (
            picture_type,
            "it gives MediaTrackHandler 1 type, which takes none.",
            "Write `MediaTrackHandler` without brackets.",
        ),
    ],
)
def test_a_wrong_number_of_types_is_told(make: Callable[[], None], message: str, cure: str) -> None:
    with pytest.raises(MosaicError) as refused:
        make()
    line = inspect.getsourcelines(make)[1] + 1
    assert str(refused.value) == f"{__file__}:{line}: {make.__name__}.<locals>.Mine: {message} {cure}"
    assert (refused.value.at, refused.value.cure) == ((__file__, line), cure)


def test_a_base_for_others_leaves_its_types_open() -> None:
    class Base(DataChannelConfigurer[P]): ...

    class Mine(Base[NoParams]): ...

    class Older(DataChannelConfigurer):  # type: ignore[type-arg]
        params_model = NoParams

        def configure(self) -> Any:
            return self.params

    class Reader(Mine):
        def configure(self) -> Any:
            return self.params

    assert {Mine.params_model, Older.params_model, Reader.params_model} == {NoParams}


def test_a_configurer_that_takes_no_params_needs_no_brackets() -> None:
    class Mine(DataChannelConfigurer):  # type: ignore[type-arg]
        def configure(self) -> Any:
            return self.label

    assert Mine.params_model is NoParams


def test_a_handler_of_any_json_needs_no_types() -> None:
    class Mine(DataChannelReceivable): ...  # type: ignore[type-arg]

    assert Mine.data_type == "json-u2r"


class Port(Params):
    port: str = ""


def sent_params() -> None:
    class Mine(DataChannelSendable[Port]): ...


def taken_params() -> None:
    class Mine(DataChannelReceivable[Port]): ...


@pytest.mark.parametrize("make", [sent_params, taken_params])
def test_params_are_no_messages(make: Callable[[], None]) -> None:
    with pytest.raises(MosaicError) as refused:
        make()
    line, cure = (
        inspect.getsourcelines(make)[1] + 1,
        "Name a class of messages: `class Mine(Message)` with what travels.",
    )
    said = f"its messages are Port, which is a class of params. {cure}"
    assert str(refused.value) == f"{__file__}:{line}: {make.__name__}.<locals>.Mine: {said}"
