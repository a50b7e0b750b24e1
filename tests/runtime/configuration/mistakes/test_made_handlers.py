"""What a handler says only when it is made is held against the same rules as its class, before anything starts."""

from __future__ import annotations

import inspect
from typing import Any

import pytest
from support.refused_start import problems_at_start

from mosaic_core import (
    DataChannelConfigurer,
    DataChannelJsonReceivable,
    DataChannelSendable,
    Delivery,
    Handler,
    NoParams,
)
from mosaic_core.testing import connector, joined
from mosaic_core.words.config import SafetyConfig
from mosaic_core.words.errors import Problem


class Wheels(DataChannelJsonReceivable):
    def __init__(self, label: str, **said: Any) -> None:
        super().__init__(label)
        for name, value in said.items():
            setattr(self, name, value)

    def handle_data(self, data: dict[str, Any]) -> None:
        """Turns."""


class Stops(Wheels):
    def make_safe(self, cause: str) -> None:
        """Stands."""


class Leased(Wheels):
    resource = "arm"


class State(DataChannelSendable[str]):
    """Tells how it is."""


def configurer_of(*handlers: Handler) -> Any:
    class OneConfigurer(DataChannelConfigurer[NoParams]):
        connector_type = "one"

        def configure(self) -> tuple[Handler, ...]:
            return handlers

    return OneConfigurer


def refusal_of(*handlers: Handler) -> Problem:
    (problem,) = problems_at_start(configurer_of(*handlers), label="it")
    assert problem.code == "config.broken_plugin"
    return problem


def place_of(kind: type) -> str:
    return f"{__file__}:{inspect.getsourcelines(kind)[1]}"


@pytest.mark.parametrize(
    ("handler", "words"),
    [
        (Wheels("it", timeout_s=0.5), "timeout_s is set, and after it nothing would happen: make_safe is not written."),
        (Stops("it", timeout_s="0.5"), "timeout_s is '0.5', and no number. Write seconds, such as 0.5."),
        (Stops("it", timeout_s=3600), "timeout_s is 3600, and no time-out."),
        (Wheels("it", requires_lease="yes"), "requires_lease is 'yes', and no truth value."),
        (Wheels("it", requires_lease=True, resource="The arm"), "the lease of 'The arm' can't be taken."),
        (Wheels("it", limits={"x": 1.0}), "the limit of 'x' is a float. Write FieldBounds(min=…, max=…)."),
        (Wheels("it", item_names="elbow"), "item_names is 'elbow', and no tuple of names."),
        (Wheels("it", delivery="latest"), "delivery is 'latest', and no way to deliver."),
        (Wheels("it", widget="joystik"), "there is no widget 'joystik'"),
    ],
)
def test_what_only_the_instance_says_is_told_with_its_class_and_line(handler: Handler, words: str) -> None:
    problem = refusal_of(handler)
    kind = type(handler)
    assert problem.message.startswith("connector 'it' of ")
    assert f" can't be made: {kind.__name__}: {words}" in f"{problem.message} {problem.cure}"
    assert f"{problem.file}:{problem.line}" == place_of(kind)


async def test_what_it_may_say_is_taken() -> None:
    handler = Stops("it", timeout_s=0.5, requires_lease=True, resource="arm", delivery=Delivery.LATEST)
    async with joined(connector(configurer_of(handler), label="it")) as joint:
        assert joint.operator is not None


def test_two_handlers_of_one_label_are_told_with_their_classes() -> None:
    problem = refusal_of(Wheels("it"), State("it"))
    told = f" makes two handlers of one label 'it': Wheels ({place_of(Wheels)}) and State ({place_of(State)})"
    assert problem.message.endswith(told)
    assert problem.cure.startswith("give each a label of its own")


def test_a_resource_without_a_lease_is_told() -> None:
    problem = refusal_of(Leased("it"))
    assert problem.message.endswith("Leased needs no lease, so that its resource 'arm' guards nothing")
    assert f"{problem.file}:{problem.line}" == place_of(Leased)
    assert problem.cure == "write requires_lease = True in Leased, or remove its resource"


async def test_the_file_may_say_that_its_resource_is_leased() -> None:
    safety = SafetyConfig(requires_lease=True)
    async with joined(connector(configurer_of(Leased("it")), label="it", safety=safety)) as joint:
        assert joint.operator is not None
