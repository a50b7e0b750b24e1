"""What pydantic refuses of an author's code is told in our words, with the nearest name."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, Literal

import pytest

from mosaic_core import DeviceGone, Message, Params, Refused
from mosaic_core.runtime.threads.code_places import explained_error
from mosaic_core.runtime.threads.error_words import meant_by, said_by
from mosaic_core.runtime.threads.stacks import PluginCode
from mosaic_core.words.safety_config import FieldBounds


class Warmth(Message):
    value_c: float
    colour: Literal["red", "blue"] = "red"


class Reading(Params):
    period_s: float = 1.0


@pytest.mark.parametrize(
    ("made", "words"),
    [
        (lambda: Warmth(value_c="warm"), "Warmth: value_c: expected a number, got 'warm'"),
        (lambda: Warmth(), "Warmth: 'value_c' is missing"),
        (
            lambda: Warmth(value_c=1, colour="rde"),
            "Warmth: colour: expected 'red' or 'blue', got 'rde' (did you mean 'red'?)",
        ),
        (lambda: FieldBounds(maxx=1), "FieldBounds: unknown key 'maxx' (did you mean 'max'?)"),
        (lambda: FieldBounds(zzz=1, min="a"), "FieldBounds: min: expected a number, got 'a'; unknown key 'zzz'"),
        (lambda: Reading.model_validate({"perod_s": 1}), "Reading: unknown key 'perod_s' (did you mean 'period_s'?)"),
        (lambda: Warmth.model_validate([1]), "Warmth: expected a mapping of keys to values, got [1]"),
        (lambda: Warmth(value_c="x" * 999), f"Warmth: value_c: expected a number, got '{'x' * 59}"),
    ],
)
def test_what_a_model_refuses_is_told_by_field(made: Callable[[], Any], words: str) -> None:
    with pytest.raises(ValueError, match="validation error") as caught:
        made()
    assert said_by(caught.value) == f"ValidationError: {words}"
    assert explained_error(caught.value).startswith(f"ValidationError: {words} ({__file__}:")


def test_many_mistakes_are_bounded() -> None:
    with pytest.raises(ValueError, match="validation error") as caught:
        FieldBounds(**dict.fromkeys("abcdefgh", 1))
    assert said_by(caught.value).count("unknown key") == 4


@pytest.mark.parametrize(
    ("written", "meant"),
    [
        ("from mosaic_core import DataChanelSendable", "did you mean 'DataChannelSendable'?"),
        (
            "from mosaic_core.contract import DataChanelSendable",
            "did you mean `from mosaic_core import DataChannelSendable`?",
        ),
        ("from mosaic_core.contract import Message", "did you mean `from mosaic_core import Message`?"),
        ("from mosaic_core.contract import JointStat", "did you mean `from mosaic_core.messages import JointState`?"),
        ("from mosaic_core.messages import BateryState", "did you mean 'BatteryState'?"),
        ("from mosaic_core.testing import colect", "did you mean 'collect'?"),
        ("from json import lods", "did you mean 'loads'?"),
        ("import mosaic_core.message", "did you mean 'mosaic_core.messages'?"),
        ("from mosaic_core import qqqqqq", ""),
        ("import mosaic_core.qqqqqq", ""),
        ("import qqqqqq", ""),
    ],
)
def test_an_import_that_fails_is_told_with_what_was_meant(written: str, meant: str) -> None:
    with pytest.raises(ImportError) as caught:
        exec(written)  # noqa: S102 - an import as an author writes it
    assert said_by(caught.value) == f"{type(caught.value).__name__}: {caught.value}" + (f"; {meant}" if meant else "")


GONE, AWAY, NOT_SO, BUG = DeviceGone("gone"), DeviceGone("away"), Refused("not.so"), ValueError("bug")


@pytest.mark.parametrize(
    ("error", "meant"),
    [
        (BUG, BUG),
        (ExceptionGroup("unhandled", [BUG]), BUG),
        (ExceptionGroup("unhandled", [GONE, ExceptionGroup("inner", [AWAY])]), GONE),
        (ExceptionGroup("unhandled", [NOT_SO, NOT_SO]), NOT_SO),
    ],
)
def test_a_task_group_stands_for_its_only_error_and_for_absences_alone(
    error: BaseException, meant: BaseException
) -> None:
    assert meant_by(error) is meant


def test_a_group_of_different_errors_tells_each() -> None:
    group = ExceptionGroup("unhandled", [GONE, BUG])
    assert meant_by(group) is group
    assert said_by(group) == "DeviceGone: gone; ValueError: bug"


def test_a_generator_that_runs_out_of_another_is_told_with_its_line() -> None:
    def body() -> Iterator[str]:
        yield next(iter(()))

    with pytest.raises(RuntimeError, match="generator raised StopIteration") as caught:
        next(body())
    assert caught.value.__traceback__ is not None
    without_the_test = caught.value.with_traceback(None)
    line = body.__code__.co_firstlineno + 1
    assert PluginCode(()).place_of(without_the_test) == f"{__file__}:{line} in {body.__qualname__}"
