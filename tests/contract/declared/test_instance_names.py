"""An attribute that ``__init__`` sets and that hides the framework's own, or is misspelt, is refused when made."""

from __future__ import annotations

import inspect
from typing import Any

import pytest

from mosaic_core import (
    DataChannelBidirectional,
    DataChannelConfigurer,
    DataChannelReceivable,
    Keeper,
    Message,
    MosaicError,
    NoParams,
)
from mosaic_core.testing import build
from mosaic_core.words.errors import ConfigError


class Lift(DataChannelReceivable[dict[str, Any]]):
    attributes: dict[str, Any]

    def handle_data(self, data: dict[str, Any]) -> None:
        self.told = (data, self.time_out_s)

    def make_safe(self, cause: str) -> None:
        """Nothing moves."""

    time_out_s: float


def made_with(name: str, value: object) -> Lift:
    class Set(Lift):
        def __init__(self, label: str) -> None:
            super().__init__(label)
            setattr(self, name, value)

    class SetConfigurer(DataChannelConfigurer[NoParams]):
        def configure(self) -> Lift:
            return Set(self.label)

    return build(SetConfigurer)


@pytest.mark.parametrize("name", ["_host", "pause", "every", "make_safe"])
def test_what_the_framework_has_is_not_set(name: str) -> None:
    with pytest.raises(MosaicError, match=rf"Set: it sets {name}, which is the framework's own\. \(Give yours another"):
        made_with(name, "192.168.1.4")


@pytest.mark.parametrize(
    ("name", "meant"), [("timout_s", "timeout_s"), ("require_lease", "requires_lease"), ("resorce", "resource")]
)
def test_a_misspelt_value_is_told_with_the_one_that_was_meant(name: str, meant: str) -> None:
    with pytest.raises(MosaicError, match=rf"it sets '{name}', which nothing reads; did you mean '{meant}'\?"):
        made_with(name, 1)


@pytest.mark.parametrize("name", ["send", "limit", "motion", "timeout_s", "time_out_s", "_timout"])
def test_a_name_of_the_authors_own_is_left_alone(name: str) -> None:
    """``send``: a receiver has none; ``limit``: another word; ``time_out_s``: his own code reads it."""
    made_with(name, 1.0)


def test_a_body_may_be_a_function_of_the_instance() -> None:
    told: list[Any] = []
    made_with("handle_data", told.append).handle_data({"x": 1})
    assert told == [{"x": 1}]


@pytest.mark.parametrize("name", ["kind", "data_type"])
def test_what_follows_from_the_base_is_not_set(name: str) -> None:
    with pytest.raises(MosaicError) as told:
        made_with(name, "servo")
    said = f"Set: it sets {name}, which is read of its class."
    assert said in str(told.value)
    assert "Give yours another name: what it carries follows from its base" in str(told.value)


def test_what_it_sends_is_said_in_the_class() -> None:
    class Both(DataChannelBidirectional[dict[str, Any]]):
        def __init__(self, label: str) -> None:
            super().__init__(label)
            self.sends = Message  # type: ignore[misc]

    class BothConfigurer(DataChannelConfigurer[NoParams]):
        def configure(self) -> Both:
            return Both(self.label)

    with pytest.raises(ConfigError) as told:
        build(BothConfigurer)
    (problem,) = told.value.problems
    assert problem.message.endswith("Both: it sets sends, which is read of its class.")
    assert problem.cure == "Write it in the body of the class: sends = …."
    assert (problem.file, problem.line) == (__file__, inspect.getsourcelines(Both)[1])
    made_with("sends", 1)  # a receiver has none


class Device:
    def __init__(self) -> None:
        self.bus = Keeper("bus", lambda: None)


@pytest.mark.parametrize(
    ("keeper", "said"),
    [
        (Device(), "a Device, and no Keeper. Name its own: self.keeper = ….bus, or leave it out."),
        (
            Keeper,
            "the class Keeper, and no Keeper. Name the Keeper that keeps its device open, or leave it out.",
        ),
        ("bus", "a str, and no Keeper. Name the Keeper that keeps its device open, or leave it out."),
    ],
)
def test_a_device_in_place_of_its_keeper_is_told(keeper: object, said: str) -> None:
    with pytest.raises(ConfigError) as told:
        made_with("keeper", keeper)
    (problem,) = told.value.problems
    assert f"{problem.message} {problem.cure}".endswith(f"Set: its keeper is {said}")
    assert (problem.file, problem.line) == (__file__, inspect.getsourcelines(made_with)[1] + 1)


def test_a_keeper_or_none_is_taken() -> None:
    for keeper in (Device().bus, None):
        made_with("keeper", keeper)
