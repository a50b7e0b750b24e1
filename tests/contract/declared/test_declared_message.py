"""What a handler sends is what its class declares; what isn't is told with class, line and fields."""

from __future__ import annotations

import json
import logging
import math
from collections.abc import AsyncIterator, Iterator
from datetime import datetime
from types import MappingProxyType
from typing import Any

import numpy as np
import pytest
from pydantic import AliasChoices, BaseModel, Field, TypeAdapter

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
        ({"angle_rad": "1"}, "keys angle_rad (angle_rad: Input should be a valid number"),
        ({"angle_rad": 1, "range": 2}, "keys angle_rad, range (no field 'range': did you mean 'range_m'?)"),
        ({"angle_rad": "far"}, "keys angle_rad (angle_rad: Input should be a valid number"),
        (Far(metres=1), "Far (none of its fields)"),
        ([1.0], "list"),
        ("1.0", "str"),
        (b"1", "bytes"),
    ],
)
def test_anything_else_is_told_with_class_line_and_fields(value: Any, what: str) -> None:
    line = Lidar.messages.__code__.co_firstlineno + 1
    with pytest.raises(MosaicError) as caught:
        collect(Lidar(value), 1)
    assert caught.value.code == "plugin.wrong_message"
    assert f"Lidar ({__file__}:{line}) declares Scan and sends {what}" in caught.value.message


class Winding(DataChannelSendable[Scan]):
    def messages(self) -> Iterator[Any]:
        yield Scan(angle_rad=1.0)
        yield from self._more()

    def _more(self) -> Iterator[Any]:
        yield Scan(angle_rad=2.0)
        yield {"angle": 3.0}


class Waiting(DataChannelSendable[Scan]):
    async def messages(self) -> AsyncIterator[Any]:
        yield Scan(angle_rad=1.0)
        yield {"angle": 3.0}


class Listed(DataChannelSendable[Scan]):
    def messages(self) -> Any:
        return [{"angle": 3.0}]


@pytest.mark.parametrize(
    ("kind", "line"),
    [
        (Winding, Winding._more.__code__.co_firstlineno + 2),
        (Waiting, Waiting.messages.__code__.co_firstlineno + 2),
        (Listed, Listed.messages.__code__.co_firstlineno),
    ],
)
def test_the_line_is_that_of_the_yield_where_there_is_one(kind: Any, line: int) -> None:
    with pytest.raises(MosaicError) as caught:
        collect(kind("it"), 3)
    assert caught.value.message.startswith(f"{kind.__name__} ({__file__}:{line}) declares Scan and sends keys angle (")


def test_a_message_that_is_returned_instead_of_yielded_is_told() -> None:
    class Returns(Lidar):
        def messages(self) -> Any:
            return self.yields[0]

    for one, kind in ((Scan(angle_rad=1.0), "Scan"), ({"angle_rad": 1.0}, "dict"), ("far", "str")):
        with pytest.raises(MosaicError) as caught:
            collect(Returns(one), 1)
        place = f"{__file__}:{Returns.messages.__code__.co_firstlineno}"
        cure = "Return it by `yield` instead of `return`."
        said = f"{Returns.messages.__qualname__}() ({place}) returned {kind}, which is one message. {cure}"
        assert (caught.value.message, caught.value.code) == (said, "plugin.wrong_message")


def test_the_line_of_what_is_pushed_is_that_of_the_push() -> None:
    lidar = Lidar()
    fake_host(lidar)
    with pytest.raises(MosaicError) as caught:
        lidar.send_json({"angle": 3.0})
    line = test_the_line_of_what_is_pushed_is_that_of_the_push.__code__.co_firstlineno + 4
    assert f"Lidar ({__file__}:{line}) declares Scan" in caught.value.message


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
    usual = Counted.model_validate_json

    def counted(value: Any, **how: Any) -> Any:
        validated.append(value)
        return usual(value, **how)

    monkeypatch.setattr(Counted, "model_validate_json", counted)
    for number in range(5):
        meter.send_json({"v": number})
    assert validated == ['{"v":0}']


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
    with caplog.at_level(logging.WARNING, "mosaic_core"), pytest.raises(AssertionError, match="2 of 3 messages"):
        collect(lidar)
    assert sent_by(lidar) == [{"angle_rad": 1.0}]
    assert fake_host(lidar).losses == {"refused": 2}
    assert [record.message for record in caplog.records] == [
        f"connector 'lidar': {Meter.__qualname__} ({__file__}:{Lidar.messages.__code__.co_firstlineno + 1}) sends "
        "'angle_rad', which is no finite number and not declared as `float | None`: refused (plugin.wrong_message)"
    ]


class Cloud(Message):
    scan: Scan | None = None
    percent: float = Field(default=0.0, ge=0, le=100)
    heights_m: list[float | None] = Field(default=[])
    by_name: dict[str, float] = Field(default={})
    anything: Any = None


NAN = math.nan


@pytest.mark.parametrize(
    ("said", "field"),
    [
        ({"percent": NAN}, "percent"),
        ({"percent": np.float32("inf")}, "percent"),
        ({"percent": "nan"}, "percent"),
        ({"by_name": {"a": 1.0, "b": -math.inf}}, "by_name.b"),
        ({"anything": NAN}, ""),
        ({"scan": {"angle_rad": NAN, "range_m": 1.0}}, "scan.angle_rad"),
        ({"scan": Scan(angle_rad=NAN)}, "scan.angle_rad"),
    ],
)
def test_a_message_of_a_number_that_is_none_is_made_and_refused_where_it_is_sent(
    said: dict[str, Any], field: str, caplog: pytest.LogCaptureFixture
) -> None:
    class Sends(DataChannelSendable[Cloud]):
        pass

    sends = Sends("it")
    fake_host(sends)
    with caplog.at_level(logging.WARNING, "mosaic_core"):
        assert sends.send(Cloud(**said)) is (field == "")
    told = [record.message for record in caplog.records]
    assert [f" sends '{field}', which is no finite number" in text for text in told] == ([True] if field else [])


def test_a_number_that_is_too_large_stays_what_it_is() -> None:
    made = Cloud(percent=math.inf, by_name={"a": -math.inf})
    assert (made.percent, made.by_name) == (math.inf, {"a": -math.inf})


def test_what_may_be_absent_is_sent_beside_it_as_null() -> None:
    class Sends(DataChannelSendable[Cloud]):
        pass

    sends = Sends("it")
    fake_host(sends)
    made = Cloud(heights_m=[1.0, NAN], scan=Scan(angle_rad=1.0, range_m=NAN))
    assert sends.send(made)
    assert sent_by(sends)[0]["heights_m"] == [1.0, None]
    assert sent_by(sends)[0]["scan"] == {"angle_rad": 1.0, "range_m": None}
    assert Scan(angle_rad=NAN, range_m=math.inf).range_m is None


@pytest.mark.parametrize("said", [{"percent": "much"}, {"percent": 101.0}, {"percent": NAN, "scan": 3}])
def test_any_other_mistake_is_told_where_the_message_is_made(said: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match="validation error"):
        Cloud(**said)


@pytest.mark.parametrize(
    "received", [{"percent": NAN}, {"scan": {"angle_rad": NAN}}, {"by_name": {"a": NAN}}, {"anything": NAN}]
)
def test_what_is_received_never_has_one(received: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match="validation error"):
        Cloud.model_validate(received)
    with pytest.raises(ValueError, match="validation error"):
        TypeAdapter(list[Cloud]).validate_python([received])


def test_a_keyword_that_is_no_field_is_told_with_its_line_and_the_nearest() -> None:
    with pytest.raises(MosaicError) as caught:
        Scan(angle_rad=1.0, range_n=2.0)
    assert caught.value.code == "plugin.wrong_message"
    line = test_a_keyword_that_is_no_field_is_told_with_its_line_and_the_nearest.__code__.co_firstlineno + 2
    assert str(caught.value) == (
        f"{__file__}:{line}: Scan has no field 'range_n'; did you mean 'range_m'? It has: angle_rad, range_m. "
        "Whatever else a device says is left out by Scan.model_validate(…)."
    )
    assert Scan.model_validate({"angle_rad": 1.0, "range_n": 2.0}).range_m is None


def test_keywords_are_also_aliases_and_whatever_a_message_keeps() -> None:
    class Named(Message):
        speed: float = Field(default=0.0, alias="v")
        more: float = Field(default=0.0, validation_alias=AliasChoices("m", "n"))

    class Keeps(Message, extra="allow"):
        pass

    assert Named(v=1.0, n=2.0).more == 2.0
    assert Keeps(whatever=1).model_dump() == {"whatever": 1}


def test_an_attribute_that_was_set_to_another_type_is_told_where_it_is_sent() -> None:
    lidar, scan = Lidar(), Scan(angle_rad=1.0)
    fake_host(lidar)
    scan.angle_rad = "far"  # type: ignore[assignment]
    with pytest.raises(MosaicError, match=r"declares Scan and sends Scan \(angle_rad: Input should be a valid number"):
        lidar.send(scan)


class Choice(Message):
    angle_rad: float = 0.0


class Chooser(DataChannelSendable[Choice]):
    def __init__(self, value: Any) -> None:
        super().__init__("chooser")
        self.value = value

    def messages(self) -> Iterator[Any]:
        yield self.value


IN_ITSELF: list[Any] = []
IN_ITSELF.append(IN_ITSELF)


@pytest.mark.parametrize("value", [Far(metres=1), {"metres": 1}])
def test_a_message_of_which_all_may_be_left_out_is_not_just_anything(value: Any) -> None:
    with pytest.raises(MosaicError, match=r"declares Choice and sends .*\(none of its fields\)"):
        collect(Chooser(value), 1)
    assert collect(Chooser({}), 1) == [{}]


@pytest.mark.parametrize(
    ("value", "told"),
    [
        ({"angle_rad": np.float32(1)}, "sends 'angle_rad' as float32, .*: write float"),
        ({"angle_rad": 1, "near": [{"at": np.int64(3)}]}, r"sends 'near\.0\.at' as int64, .*: write float"),
        ({"angle_rad": 1, "all": np.zeros(3)}, r"sends 'all' as ndarray float64 \(3,\), .*: write \.tolist\(\) of it"),
        ({"angle_rad": 1, "at": datetime(2026, 1, 1)}, r"sends 'at' as datetime, .*: write \.isoformat\(\)"),
        ({"angle_rad": 1, "raw": b"1"}, "sends 'raw' as bytes, .*: send bytes from a DataChannelSendable"),
        ({"angle_rad": 1, "at": {(0, 1): 2}}, r"sends 'at\.\(0, 1\)' as tuple, .*: write numbers, text"),
        ({"angle_rad": 1, "some": {1}}, r"sends 'some' as set, .*: write sorted\(…\) of it"),
        ({"angle_rad": 1, "odd": MappingProxyType({})}, r"sends 'odd' as mappingproxy, .*: write dict\(…\) of it"),
        ({"angle_rad": 1, "odd": object()}, "sends 'odd' as object, .*: write numbers, text, lists and mappings"),
        ({"angle_rad": 1, "at": {math.nan: 2}}, r"sends 'at\.nan' as a key nan, .*: name it with text"),
        ({"angle_rad": 1, "at": ["caf\udce9"]}, r"sends 'at\.0' as text with half a character, .*: write \.encode\("),
        ({"angle_rad": 1, "caf\udce9": 1}, r"sends 'caf\\\\udce9' as text with half a character, .*: write \.encode\("),
        ({"angle_rad": 1, "in": IN_ITSELF}, r"sends 'in\.0\..*' as a list without end, .*: nest it 32 deep at most"),
    ],
)
def test_what_json_does_not_know_is_told_with_line_field_and_cure(value: Any, told: str) -> None:
    line = Lidar.messages.__code__.co_firstlineno + 1
    with pytest.raises(MosaicError, match=told) as caught:
        collect(Lidar(value), 1)
    assert caught.value.code == "plugin.wrong_message"
    assert caught.value.message.startswith(f"Lidar ({__file__}:{line}) sends ")


class Stretch(Message):
    span: tuple[float, float | None]
    at: datetime | None = None
    marks: set[int] = Field(default_factory=set)
    path: tuple[float, ...] = ()


class Stretches(DataChannelSendable[Stretch]):
    pass


@pytest.mark.parametrize(
    ("value", "sent"),
    [
        (Stretch(span=(1.0, math.nan)), {"span": [1.0, None]}),
        ({"span": (1.0, math.nan)}, {"span": [1.0, None]}),
        ({"span": [1.0, None], "at": "2026-01-01T00:00:00Z"}, {"span": [1.0, None], "at": "2026-01-01T00:00:00Z"}),
    ],
)
def test_what_json_spells_as_a_list_or_as_text_is_sent_and_null_where_it_may_be(value: Any, sent: Any) -> None:
    stretches = Stretches("stretch")
    fake_host(stretches)
    assert stretches.send(value)
    (found,) = sent_by(stretches)
    assert {key: found[key] for key in sent} == sent


def test_a_place_of_a_tuple_that_is_never_absent_refuses_the_message(caplog: pytest.LogCaptureFixture) -> None:
    stretches = Stretches("stretch")
    assert not stretches.send(Stretch(span=(math.nan, 1.0)))
    assert "sends 'span[]', which is no finite number and not declared as `float | None`" in caplog.text
    assert sent_by(stretches) == []


@pytest.mark.parametrize(
    ("value", "what"),
    [
        ({"span": [1.0]}, "span.1: Field required"),
        ({"span": "12"}, "span: Input should be a valid array"),
        ({"span": [1.0, 2.0], "at": "yesterday"}, "at: Input should be a valid datetime"),
        ({"span": [1.0, 2.0], "path": [], "marks": ["a"]}, "marks.0: Input should be a valid integer"),
        ({"span": 1, "marks": "x"}, "span: Input should be a valid array; marks: Input should be a valid array"),
    ],
)
def test_what_is_none_of_these_is_told(value: Any, what: str) -> None:
    class Others(DataChannelSendable[Stretch]):
        """Of no known shape."""

    with pytest.raises(MosaicError) as told:
        Others("stretch").send(value)
    assert what in told.value.message
