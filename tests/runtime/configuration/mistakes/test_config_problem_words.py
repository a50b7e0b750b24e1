"""One mistake is told once, in words."""

from __future__ import annotations

from datetime import date, datetime, timedelta
from enum import Enum
from pathlib import Path
from typing import Annotated, Any, Literal

import pytest
from pydantic import Field, HttpUrl, IPvAnyAddress

from mosaic_core import Params
from mosaic_core.runtime.configuration.config_problems import validated
from mosaic_core.runtime.configuration.yaml_document import YamlDocument
from mosaic_core.words.safety_config import SafetyConfig


def told(safety: dict[str, Any]) -> list[tuple[str, str, str]]:
    _, problems = validated(SafetyConfig, safety, YamlDocument(safety), ())
    return [(one.path, one.message, one.cure) for one in problems]


@pytest.mark.parametrize(
    ("safety", "path", "message", "cure"),
    [
        ({"slow_down": {"loss": [[0.1, 2]]}}, "slow_down", "loss: a factor is a number from 0 to 1", ""),
        ({"slow_down": {"loss": [["a", 1]]}}, "slow_down.loss[0][0]", "expected a number, got 'a'", ""),
        ({"slow_down": {"loss": "of"}}, "slow_down.loss", "expected a list or 'off', got 'of'", "did you mean 'off'?"),
        ({"slow_down": 3}, "slow_down", "expected a mapping of keys to values or 'off', got 3", ""),
        (
            {"resource": "Arm 1"},
            "resource",
            "expected a name of small letters, digits, - and _ (at most 32, a letter first) such as arm, got 'Arm 1'",
            "",
        ),
        (
            {"limits": {"linear x": {"max": 1}}},
            "limits.linear x",
            "expected the dotted path of a number in the message, such as linear.x, got 'linear x'",
            "",
        ),
        (
            {"on_timeout": "callbak"},
            "on_timeout",
            "expected 'callback', 'zero' or 'hold', got 'callbak'",
            "did you mean 'callback'?",
        ),
    ],
)
def test_a_mistake_is_told_once_and_in_words(safety: dict[str, Any], path: str, message: str, cure: str) -> None:
    assert told(safety) == [(path, message, cure)]


def test_two_mistakes_side_by_side_are_both_told() -> None:
    found = told({"slow_down": {"loss": "of", "rtt_ms": [["a", 1]]}})
    assert {path for path, _, _ in found} == {"slow_down.loss", "slow_down.rtt_ms[0][0]"}
    assert len(found) == 2


def test_a_word_far_from_all_that_are_taken_is_answered_with_what_these_mean() -> None:
    ((_, message, cure),) = told({"on_timeout": "stop"})
    assert message == "expected 'callback', 'zero' or 'hold', got 'stop'"
    assert "`callback` runs the connector's safe action" in cure


class Colour(Enum):
    RED = "red"
    GREEN = "green"


class Serial(Params):
    kind: Literal["serial"]
    port: str = "/dev/ttyACM0"


class Udp(Params):
    kind: Literal["udp"]
    host: str = "localhost"


class Part(Params):
    depth: int = 1
    name: Literal["alpha", "beta"] = "alpha"


class Everything(Params):
    colour: Colour = Colour.RED
    is_on: Literal[True, "auto"] = True
    part: Part | None = None
    parts: list[Part] = Field(default=[])
    by_name: dict[str, list[Part]] = Field(default={})
    pair: tuple[int, int] = (1, 2)
    link: Annotated[Serial | Udp, Field(discriminator="kind")] | None = None
    either: Serial | Udp | None = None
    number_or_text: int | str = 1
    url: HttpUrl | None = None
    address: IPvAnyAddress | None = None
    file: Path | None = None
    ids: frozenset[int] = frozenset()
    code: str = Field(default="a", pattern="^a+$")
    lasts: timedelta | None = None
    at: datetime | None = None
    day: date | None = None


def said_of(params: dict[str, Any]) -> list[tuple[str, str, str]]:
    _, problems = validated(Everything, params, YamlDocument(params), ())
    return [(one.path, one.message, one.cure) for one in problems]


@pytest.mark.parametrize(
    ("params", "path", "message", "cure"),
    [
        ({"colour": "gren"}, "colour", "expected 'red' or 'green', got 'gren'", "did you mean 'green'?"),
        ({"is_on": "atuo"}, "is_on", "expected true or 'auto', got 'atuo'", "did you mean 'auto'?"),
        ({"part": {"detph": 1}}, "part.detph", "unknown key 'detph'", "did you mean 'depth'?"),
        ({"parts": [{}, {"nmae": 1}]}, "parts[1].nmae", "unknown key 'nmae'", "did you mean 'name'?"),
        ({"by_name": {"a": [{"depht": 1}]}}, "by_name.a[0].depht", "unknown key 'depht'", "did you mean 'depth'?"),
        (
            {"by_name": {"a": [{"name": "bata"}]}},
            "by_name.a[0].name",
            "expected 'alpha' or 'beta', got 'bata'",
            "did you mean 'beta'?",
        ),
        ({"pair": [1]}, "pair", "item 2 of the list is missing", ""),
        ({"link": {"kind": "seral"}}, "link.kind", "expected 'serial' or 'udp', got 'seral'", "did you mean 'serial'?"),
        ({"link": {"port": "x"}}, "link.kind", "'kind' is missing", ""),
        ({"link": {"kind": "udp", "hots": "x"}}, "link.hots", "unknown key 'hots'", "did you mean 'host'?"),
        ({"either": {"kind": "udp", "hots": "x"}}, "either.hots", "unknown key 'hots'", "did you mean 'host'?"),
        ({"either": {"kind": "upd"}}, "either.kind", "expected 'serial' or 'udp', got 'upd'", "did you mean 'udp'?"),
        ({"number_or_text": [1]}, "number_or_text", "expected a whole number or text, got a list", ""),
        ({"url": "mosaic"}, "url", "expected a URL such as https://example.org, got 'mosaic'", ""),
        ({"url": "ftp://a"}, "url", "expected a URL that begins with 'http' or 'https', got 'ftp://a'", ""),
        ({"address": "300.1.1.1"}, "address", "expected an IP address such as 192.168.0.1, got '300.1.1.1'", ""),
        ({"file": [1]}, "file", "expected a path, got a list", ""),
        ({"ids": 3}, "ids", "expected a list, got 3", ""),
        ({"ids": {"a": 3}}, "ids", "expected a list", "begin each entry with `- `"),
        ({"code": "b"}, "code", "expected text that matches ^a+$, got 'b'", ""),
        ({"lasts": "long"}, "lasts", "expected a duration such as 00:00:30, got 'long'", ""),
        ({"at": "noon"}, "at", "expected a date and time such as 2026-01-31T12:00:00Z, got 'noon'", ""),
        ({"day": "monday"}, "day", "expected a date such as 2026-01-31, got 'monday'", ""),
    ],
)
def test_whatever_params_say_wrongly_is_told_once_and_in_words(
    params: dict[str, Any], path: str, message: str, cure: str
) -> None:
    assert said_of(params) == [(path, message, cure)]


def test_of_two_models_the_nearer_one_is_meant() -> None:
    found = said_of({"either": {"kind": "serial", "prot": 1, "baud": 1}})
    assert [path for path, _, _ in found] == ["either.prot", "either.baud"]
