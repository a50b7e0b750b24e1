"""What nothing would follow is refused when the class is made, with its class, line and cure."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, ClassVar

import pytest
from pydantic import Field

from mosaic_core import (
    AudioReceivable,
    DataChannelBidirectional,
    DataChannelReceivable,
    DataChannelSendable,
    Delivery,
    DeliveryContract,
    Handler,
    MediaTrackHandler,
    Message,
)
from mosaic_core.words.codes import REASONS
from mosaic_core.words.errors import MosaicError


class Wish(Message):
    speed: float = Field(default=0.0, alias="v")
    angle: float = 0.0


def refusal_of(make: Any) -> str:
    with pytest.raises(MosaicError) as refused:
        make()
    assert refused.value.code in REASONS
    assert refused.value.cure in str(refused.value)
    file, line, told = str(refused.value).split(":", 2)
    assert file == __file__
    first = make.__code__.co_firstlineno
    assert first <= int(line) <= first + 3
    return told.rpartition("<locals>.")[2]


def test_a_body_that_nobody_calls_is_refused() -> None:
    def make() -> None:
        class Echo(DataChannelBidirectional[Wish]):
            def messages(self) -> Iterator[Wish]:
                yield Wish()

    cure = "Derive it from DataChannelSendable, or give the method another name."
    assert refusal_of(make) == f"Echo: nobody calls its messages(). {cure}"


@pytest.mark.parametrize(
    ("base", "name", "owner"),
    [
        (DataChannelSendable, "handle_data", "DataChannelReceivable"),
        (DataChannelSendable, "make_safe", "DataChannelReceivable"),
        (DataChannelSendable, "reported_position", "DataChannelReceivable"),
        (DataChannelReceivable, "frames", "MediaTrackHandler"),
        (MediaTrackHandler, "sounds", "AudioTrackHandler"),
        (MediaTrackHandler, "handle_sound", "AudioReceivable"),
        (Handler, "messages", "DataChannelSendable"),
    ],
)
def test_every_body_has_its_base(base: type, name: str, owner: str) -> None:
    with pytest.raises(MosaicError, match=rf"nobody calls its {name}\(\)\. Derive it from {owner}"):
        type("Misplaced", (base,), {name: lambda self: None, "__module__": __name__})


def test_a_mixin_may_bring_a_body_to_its_base() -> None:
    class Talks:
        def messages(self) -> Iterator[Wish]:
            yield Wish()

    class Both(Talks, DataChannelSendable[Wish]):
        def messages(self) -> Iterator[Wish]:
            yield from super().messages()

    assert [*Both("b").messages()] == [Wish()]


@pytest.mark.parametrize("base", [MediaTrackHandler, AudioReceivable])
@pytest.mark.parametrize("delivery", [Delivery.BULK, DeliveryContract(mode=Delivery.BULK)])
def test_no_picture_and_no_sound_is_bulk(base: type, delivery: Any) -> None:
    with pytest.raises(
        MosaicError, match=r"Film: pictures and sound are never delivered as bulk\. Leave `delivery` out"
    ):
        type("Film", (base,), {"delivery": delivery, "__module__": __name__})


def test_a_field_that_its_messages_do_not_have_is_refused_with_the_nearest() -> None:
    def make() -> None:
        class Arm(DataChannelReceivable[Wish]):
            position_fields: ClassVar[tuple[str, ...]] = ("angel",)

    words = "Arm: position_fields names 'angel', a number that its messages don't have; did you mean 'angle'?"
    assert refusal_of(make) == f"{words} They have: angle, v."


def test_a_field_is_named_as_the_json_names_it() -> None:
    def make() -> None:
        class Base(DataChannelReceivable[Wish]):
            motion_fields: ClassVar[tuple[str, ...]] = ("speed",)

    assert refusal_of(make).startswith("Base: motion_fields names 'speed', a number that its messages don't have. ")


def test_a_field_is_no_velocity_and_position_at_once() -> None:
    def make() -> None:
        class Both(DataChannelReceivable[Wish]):
            motion_fields: ClassVar[tuple[str, ...]] = ("angle",)
            position_fields: ClassVar[tuple[str, ...]] = ("angle",)

    assert refusal_of(make).startswith("Both: 'angle' is in motion_fields and in position_fields. Name it once")


def test_of_messages_without_a_schema_any_field_may_be_named() -> None:
    class Loose(DataChannelReceivable[dict[str, Any]]):
        motion_fields: ClassVar[tuple[str, ...]] = ("whatever.x",)

    assert Loose.motion_fields == ("whatever.x",)
