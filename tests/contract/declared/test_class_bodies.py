"""A body that the framework can't call, or would call in vain, is told when the class is made."""

from __future__ import annotations

import inspect
from collections.abc import AsyncIterator, Iterator
from functools import cached_property
from typing import Any

import pytest

from mosaic_core import (
    AudioReceivable,
    AudioTrackHandler,
    DataChannelConfigurer,
    DataChannelJsonReceivable,
    DataChannelSendable,
    MediaTrackHandler,
    NoParams,
    RequestHandler,
)
from mosaic_core.words.errors import MosaicError


class Tells(DataChannelSendable[str]):
    """Tells a text."""


class Answers(RequestHandler[dict[str, Any], dict[str, Any]]):
    """Answers."""


class Makes(DataChannelConfigurer[NoParams]):
    """Makes nothing yet."""


async def later(self: Any, *what: Any) -> None:
    """Nobody waits for it."""


def bit_by_bit(self: Any, *what: Any) -> Iterator[None]:
    yield


async def by_and_by(self: Any, *what: Any) -> AsyncIterator[None]:
    yield


def alone(self: Any) -> None:
    """Takes nothing."""


def of_three(self: Any, one: Any, two: Any, three: Any) -> None:
    """Wants more than there is."""


class Callable:
    """No function, and called like one."""

    def __call__(self, one: Any) -> None:
        """Takes one thing."""


def by_keyword(self: Any, data: Any, *, sender: Any) -> None:
    """Wants a keyword."""


def told(base: Any, name: str, written: Any) -> str:
    with pytest.raises(MosaicError) as refused:
        type("It", (base,), {name: written, "__module__": __name__})
    place, _, rest = str(refused.value).partition(": It: ")
    assert place.startswith(f"{__file__}:")
    assert refused.value.code == "config.broken_plugin"
    return rest


@pytest.mark.parametrize(
    ("base", "name"), [(Tells, "messages"), (MediaTrackHandler, "frames"), (AudioTrackHandler, "sounds")]
)
def test_what_sends_yields(base: Any, name: str) -> None:
    assert told(base, name, later) == (
        f"{name} is an `async def` without a `yield`, and nothing of it would be sent. "
        f"Let it yield what it sends, or write `def {name}(self)` that does."
    )
    assert told(base, name, of_three).startswith(f"{name} can't be called with (): missing a required argument: 'one'")


@pytest.mark.parametrize(
    ("base", "name", "head"),
    [
        (DataChannelJsonReceivable, "make_safe", "def make_safe(self, cause)"),
        (DataChannelJsonReceivable, "reported_position", "def reported_position(self, field)"),
        (DataChannelJsonReceivable, "peer_left", "def peer_left(self, sender)"),
        (AudioReceivable, "handle_sound", "def handle_sound(self, sound, sender)"),
        (AudioReceivable, "talk_ended", "def talk_ended(self)"),
        (Makes, "configure", "def configure(self)"),
    ],
)
def test_what_is_called_and_not_awaited_is_plain(base: Any, name: str, head: str) -> None:
    for written in (later, bit_by_bit, by_and_by):
        words = f"{name} is async or yields, and nothing of it would run. Write it as a plain `{head}`."
        assert told(base, name, written) == words


@pytest.mark.parametrize(
    ("base", "name", "head"),
    [
        (DataChannelJsonReceivable, "handle_data", "def handle_data(self, data)"),
        (Answers, "answer", "def answer(self, question, request)"),
    ],
)
def test_what_acts_may_be_async_and_yields_nothing(base: Any, name: str, head: str) -> None:
    for written in (bit_by_bit, by_and_by):
        assert told(base, name, written) == (
            f"{name} yields, and nothing of it would run. Write it as a plain `{head}`."
        )
    assert issubclass(type("It", (base,), {name: later, "__module__": __name__}), base)


@pytest.mark.parametrize(
    ("base", "name", "written", "words"),
    [
        (
            DataChannelJsonReceivable,
            "handle_data",
            alone,
            "handle_data can't be called with (data): too many positional arguments. "
            "Write `def handle_data(self, data)` or `def handle_data(self, data, sender)`.",
        ),
        (DataChannelJsonReceivable, "handle_data", of_three, "handle_data can't be called with (data): missing a req"),
        (DataChannelJsonReceivable, "handle_data", by_keyword, "handle_data can't be called with (data): missing a re"),
        (DataChannelJsonReceivable, "make_safe", alone, "make_safe can't be called with (cause): too many positional"),
        (Answers, "answer", alone, "answer can't be called with (question, request): too many positional arguments"),
        (Makes, "configure", of_three, "configure can't be called with (): missing a required argument: 'one'"),
    ],
)
def test_what_it_is_called_with_it_takes(base: Any, name: str, written: Any, words: str) -> None:
    assert told(base, name, written).startswith(words)


def test_every_usual_form_is_taken() -> None:
    class Hears(DataChannelJsonReceivable):
        def handle_data(self, data: dict[str, Any], sender: Any = None, *more: Any) -> None:
            """Acts."""

        def make_safe(self, cause: str, again: bool = False) -> None:
            """Stands."""

    class Speaks(DataChannelSendable[str]):
        def messages(self) -> list[str]:
            return ["once"]

    assert (Hears("it").label, Speaks("it").messages()) == ("it", ["once"])


@pytest.mark.parametrize(
    ("base", "name", "written", "words"),
    [
        (
            Tells,
            "messages",
            property(alone),
            "messages is a property, and can't be called. Write it as a plain `def mes",
        ),
        (Tells, "messages", cached_property(alone), "messages is a cached_property, and can't be called. Write it as"),
        (
            Tells,
            "messages",
            ["once"],
            "messages is a list, and can't be called. Write it as a plain `def messages(self)`.",
        ),
        (
            DataChannelJsonReceivable,
            "handle_data",
            None,
            "handle_data is None, and can't be called. Write it as a plain `def handle_data(self, data)`. A decorator "
            "has to return the function.",
        ),
        (
            DataChannelJsonReceivable,
            "make_safe",
            staticmethod(lambda: None),
            "make_safe can't be called with (cause): to",
        ),
        (
            DataChannelJsonReceivable,
            "handle_data",
            classmethod(alone),
            "handle_data can't be called with (data): too m",
        ),
        (DataChannelJsonReceivable, "make_safe", classmethod(later), "make_safe is async or yields, and nothing of it"),
        (
            Answers,
            "answer",
            Callable(),
            "answer can't be called with (question, request): too many pos",
        ),
    ],
)
def test_a_body_is_something_that_can_be_called(base: Any, name: str, written: Any, words: str) -> None:
    assert told(base, name, written).startswith(words)


@pytest.mark.parametrize(
    "written", [staticmethod(lambda cause: None), classmethod(lambda cls, cause: None), Callable(), print]
)
def test_whatever_can_be_called_as_a_body_is_taken(written: Any) -> None:
    assert issubclass(
        type("It", (DataChannelJsonReceivable,), {"make_safe": written, "__module__": __name__}),
        DataChannelJsonReceivable,
    )


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("self", "label", "params"), "got an unexpected keyword argument 'safety'"),
        (("self", "label", "params", "safety"), "got an unexpected keyword argument 'shared'"),
        (("self",), "too many positional arguments"),
        (("self", "label", "params", "safety", "shared", "port"), "missing a required argument: 'port'"),
    ],
)
def test_a_configurer_can_be_made_as_the_robot_makes_it(arguments: tuple[str, ...], words: str) -> None:
    def make() -> None:
        names: dict[str, Any] = {}
        exec(f"def __init__({', '.join(arguments)}): pass", names)  # noqa: S102 - as an author writes it
        line.append(inspect.currentframe().f_lineno + 1)  # type: ignore[union-attr]
        type("It", (Makes,), {"__init__": names["__init__"], "__module__": __name__})

    line: list[int] = []
    with pytest.raises(MosaicError) as caught:
        make()
    assert caught.value.message == (
        f"{__file__}:{line[0]}: It: __init__ can't be called with (label, params, safety=…, shared=…): {words}. "
        f"{caught.value.cure}"
    )
    assert caught.value.cure == (
        "Write `def __init__(self, label, params, *, safety=None, shared=None)`, which begins with "
        "super().__init__(label, params, safety=safety, shared=shared)."
    )


def init_of_all(self: Any, label: str, params: Any, **more: Any) -> None:
    """Takes whatever there is."""


def test_an_init_may_pass_on_what_it_does_not_name() -> None:
    assert type("It", (Makes,), {"__init__": init_of_all, "__module__": __name__})
