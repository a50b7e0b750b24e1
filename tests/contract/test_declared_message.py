"""What a handler sends is what its class declares; what isn't is told with class, line and fields."""

from __future__ import annotations

import json
import logging
import math
from collections.abc import Iterator
from typing import Any

import pytest
from pydantic import BaseModel

from mosaic_core import DataChannelBidirectional, DataChannelSendable, Handler, Message, MosaicError
from mosaic_core.testing import collect, fake_host


class Scan(Message):
    angle_rad: float
    range_m: float | None = None


class Lidar(DataChannelSendable[Scan]):
    def __init__(self, *yields: Any) -> None:
        super().__init__("lidar")
        self.yields = yields

    def messages(self) -> Iterator[Any]:
        yield from self.yields


class Text(DataChannelSendable[str]):
    pass


class Loose(DataChannelSendable[dict[str, Any]]):
    pass


class Both(DataChannelBidirectional[Scan]):
    pass


class Near(BaseModel):
    angle_rad: float
    colour: str = "red"


class Far(BaseModel):
    metres: float


def sent_by(handler: Handler) -> list[Any]:
    return [json.loads(message.payload) for message in fake_host(handler).sent]


@pytest.mark.parametrize("value", [Scan(angle_rad=1), {"angle_rad": 1}, {"angle_rad": 1, "more": 2}, Near(angle_rad=1)])
def test_what_fits_the_declared_message_is_sent(value: Any) -> None:
    lidar = Lidar(value, value)
    collect(lidar, 2)
    assert [message["angle_rad"] for message in sent_by(lidar)] == [1, 1]


@pytest.mark.parametrize(
    ("value", "what"),
    [
        ({"range_m": 1.0}, "keys range_m (angle_rad: Field required)"),
        ({"angle_rad": "far"}, "keys angle_rad (angle_rad: Input should be a valid number"),
        (Far(metres=1), "Far (angle_rad: Field required)"),
        ([1.0], "list"),
        ("1.0", "str"),
        (b"1", "bytes"),
    ],
)
def test_anything_else_is_told_with_class_line_and_fields(value: Any, what: str) -> None:
    line = Lidar.messages.__code__.co_firstlineno
    with pytest.raises(MosaicError) as caught:
        collect(Lidar(value), 1)
    assert caught.value.code == "plugin.wrong_message"
    assert f"Lidar ({__file__}:{line}) declares Scan and sends {what}" in caught.value.message


@pytest.mark.parametrize(("handler", "good", "bad"), [(Text, "a", {"a": 1}), (Text, "a", b"a"), (Loose, {"a": 1}, "a")])
def test_text_and_loose_json_are_kept_apart(handler: Any, good: Any, bad: Any) -> None:
    it = handler("it")
    fake_host(it)
    assert it.send(good)
    with pytest.raises(MosaicError, match=f"{handler.__name__} .* sends"):
        it.send(bad)


def test_a_bidirectional_handler_declares_what_it_receives_and_sends_what_it_likes() -> None:
    both = Both("both")
    fake_host(both)
    assert both.send_json({"other": 1})
    assert both.send("text")


def test_a_shape_is_validated_once(monkeypatch: pytest.MonkeyPatch) -> None:
    class Counted(Message):
        v: float

    class Meter(DataChannelSendable[Counted]):
        pass

    meter, validated = Meter("meter"), list[Any]()
    fake_host(meter)
    usual = Counted.model_validate

    def counted(value: Any) -> Any:
        validated.append(value)
        return usual(value)

    monkeypatch.setattr(Counted, "model_validate", counted)
    for number in range(5):
        meter.send_json({"v": number})
    assert validated == [{"v": 0}]


def test_a_number_that_is_not_finite_is_null_where_it_may_be_absent() -> None:
    lidar = Lidar({"angle_rad": 1.0, "range_m": math.inf}, Scan(angle_rad=2, range_m=math.nan))
    collect(lidar, 2)
    assert sent_by(lidar) == [{"angle_rad": 1.0, "range_m": None}, {"angle_rad": 2.0, "range_m": None}]


def test_elsewhere_the_message_is_refused_and_counted_and_its_field_named_once(
    caplog: pytest.LogCaptureFixture,
) -> None:
    class Meter(Lidar):
        pass

    bad = {"angle_rad": math.nan}
    lidar = Meter(bad, bad, {"angle_rad": 1.0})
    with caplog.at_level(logging.WARNING, "mosaic_core"):
        collect(lidar, 3)
    assert sent_by(lidar) == [{"angle_rad": 1.0}]
    assert fake_host(lidar).losses == {"refused": 2}
    assert [record.message for record in caplog.records] == [
        "connector 'lidar': angle_rad of a message is no finite number, and not declared as `float | None`: refused"
    ]


def test_a_message_that_must_have_a_number_is_not_made_of_nan() -> None:
    with pytest.raises(ValueError, match="angle_rad"):
        Scan(angle_rad=math.nan)
