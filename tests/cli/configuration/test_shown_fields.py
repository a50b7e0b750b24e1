"""What `mosaic connectors show` says of the messages of a type, and of safety where something is received."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import pytest
from pydantic import Field

from mosaic_core import (
    DataChannelConfigurer,
    DataChannelReceivable,
    DataChannelSendable,
    Handler,
    Message,
    NoParams,
    Request,
    RequestHandler,
)
from mosaic_core.cli.configuration.connector_defaults import defaults_of
from mosaic_core.cli.configuration.connector_description import message_rows
from mosaic_core.runtime.configuration.resolver import ConnectorResolver

Mosaic = Callable[..., Any]


class Spot(Message):
    x_m: float = Field(description="To the right.")
    name: str = ""


class Seen(Message):
    spots: list[Spot] = Field(default=[])
    best: Spot | None = None
    lux: float = Field(json_schema_extra={"unit": "lx"})


class Shine(Message):
    percent: int = Field(ge=0, le=100)


class Eye(DataChannelSendable[Seen]):
    def messages(self) -> Iterator[Seen]:
        yield Seen(lux=1.0)


class Lamp(DataChannelReceivable[Shine]):
    def handle_data(self, data: Shine) -> None:
        """Shines."""


class Look(RequestHandler[Shine, Seen]):
    def answer(self, question: Shine, request: Request) -> Seen:
        return Seen(lux=question.percent)


class EyeConfigurer(DataChannelConfigurer[NoParams]):
    def configure(self) -> Eye:
        return Eye(self.label)


class AllConfigurer(DataChannelConfigurer[NoParams]):
    def configure(self) -> Sequence[Handler]:
        return [Eye(self.label), Lamp(f"{self.label}_lamp"), Look(f"{self.label}_look")]


SEEN = ["spots", "spots[].x_m", "spots[].name", "best", "best.x_m", "best.name", "lux"]


def test_fields_stand_by_their_way_with_those_of_inner_messages() -> None:
    eye, lamp, look = defaults_of("all", AllConfigurer)
    names = [[[one["name"] for one in channel[way]] for way in ("takes", "sends")] for channel in (eye, lamp, look)]
    assert names == [[[], SEEN], [["percent"], []], [["percent"], SEEN]]
    by_name = {one["name"]: one for one in eye["sends"]}
    assert by_name["spots[].x_m"] == {
        "name": "spots[].x_m", "type": "number", "required": True, "unit": "m", "description": "To the right.",
    }  # fmt: skip
    assert (by_name["lux"]["unit"], by_name["spots"]["required"]) == ("lx", False)
    assert lamp["takes"][0]["type"] == "integer ≥ 0, ≤ 100"


def test_a_message_that_contains_itself_has_an_end() -> None:
    inner = {"properties": {"of": {"$ref": "#/$defs/Tree"}, "leaves": {"type": "integer"}}}
    rows = message_rows({**inner, "$defs": {"Tree": inner}})
    assert [name for name, *_ in rows][-1] == "leaves"
    assert len(rows) == len({name for name, *_ in rows}) < 20


@pytest.fixture
def shown(mosaic: Mosaic, monkeypatch: pytest.MonkeyPatch) -> Callable[[type[Any]], tuple[str, dict[str, Any]]]:
    """What is printed of a class, for people and for programs."""

    def show(configurer: type[Any]) -> tuple[str, dict[str, Any]]:
        monkeypatch.setattr(ConnectorResolver, "resolve", lambda *_: configurer)
        words = ("connectors", "show", "connection-check")
        return mosaic(*words).out, json.loads(mosaic(*words, "--json").out)

    return show


def test_what_only_sends_has_no_table_of_safety(shown: Callable[[type[Any]], tuple[str, dict[str, Any]]]) -> None:
    text, found = shown(EyeConfigurer)
    assert [line.split()[:2] for line in text.splitlines() if line.startswith(("sends ", "lux "))] == [
        ["sends", "type"], ["lux", "number"],
    ]  # fmt: skip
    assert "\ntakes " not in text
    assert "\nsafety " not in text
    assert "\ndelivery " in text
    assert found["safety"] is None
    assert [one["name"] for one in found["channels"][0]["sends"]] == SEEN


def test_what_receives_has_one_and_the_fields_that_it_takes(
    shown: Callable[[type[Any]], tuple[str, dict[str, Any]]],
) -> None:
    text, found = shown(AllConfigurer)
    assert "\ntakes " in text
    assert "\nsafety " in text
    assert "timeout_s" in found["safety"]["properties"]
    defaults = dict(
        re.findall(r"^(timeout_s|on_timeout|resource|limits) .*?  +(its own|callback|none|motion) ", text, re.M)
    )
    assert defaults == {"timeout_s": "its own", "on_timeout": "callback", "resource": "its own", "limits": "its own"}
