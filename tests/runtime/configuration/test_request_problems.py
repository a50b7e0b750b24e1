"""What the YAML file says in vain of a connector that answers requests is told with its line."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from importlib.metadata import EntryPoint
from pathlib import Path

import pytest

from mosaic_core import DataChannelConfigurer, DataChannelSendable, Handler, Message, NoParams, Request, RequestHandler
from mosaic_core.runtime.configuration.auto_configurer import AutoConfigurer
from mosaic_core.runtime.configuration.config_loader import validate_file
from mosaic_core.runtime.configuration.hook_calls import hook_plugins
from mosaic_core.runtime.configuration.resolver import ConnectorResolver


class Length(Message):
    length_m: float


class Measure(RequestHandler[Length, Length]):
    def answer(self, question: Length, request: Request) -> Length:
        return question


class State(DataChannelSendable[Length]):
    def messages(self) -> Sequence[Length]:
        return [Length(length_m=1)]


class MeasureConfigurer(DataChannelConfigurer[NoParams]):
    connector_type = "measure"

    def configure(self) -> Measure:
        return Measure(self.label)


class BothConfigurer(DataChannelConfigurer[NoParams]):
    connector_type = "both"

    def configure(self) -> Sequence[Handler]:
        return [Measure(self.label), State(f"{self.label}_state")]


@pytest.fixture
def told(tmp_path: Path) -> Callable[[str], list[str]]:
    """Message and cure of each problem of a file with this connector, which stands on its third line."""
    points = [EntryPoint(one.connector_type, f"{__name__}:{one.__name__}", "mosaic.connectors") for one in KNOWN]

    def of(entry: str) -> list[str]:
        (tmp_path / "robot.yaml").write_text(f"connectors:\n  -\n    {entry}\n")
        validation = validate_file(tmp_path / "robot.yaml", resolver=ConnectorResolver(points))
        found = AutoConfigurer(resolver=ConnectorResolver(points), plugins=hook_plugins([])).rehearse(validation)
        problems = [*validation.problems, *found.problems]
        assert {one.line for one in problems} <= {3}
        return [f"{one.path}: {one.message} ({one.cure})" for one in problems]

    return of


KNOWN = (MeasureConfigurer, BothConfigurer)


@pytest.mark.parametrize(
    ("key", "value", "cure"),
    [
        ("on_loss", "hold", "remove it: a request ends when its operator leaves, and its handler is told"),
        ("on_timeout", "hold", "remove it"),
        ("slow_down", "off", "remove it: a question is asked as it is"),
        ("timeout_s", "1", "remove it: its class bounds a request by `answer_within_s`"),
        ("limits", "{ length_m: { min: 0 } }", "remove it: the model of a question bounds its numbers"),
    ],
)
@pytest.mark.parametrize("kind", ["measure", "both"])
def test_what_bounds_motion_has_no_meaning(
    told: Callable[[str], list[str]], kind: str, key: str, value: str, cure: str
) -> None:
    assert told(f"{{ type: {kind}, label: a, safety: {{ {key}: {value} }} }}") == [
        f"connectors[0].safety.{key}: connector 'a' answers requests, for which '{key}' has no meaning ({cure})"
    ]


@pytest.mark.parametrize(
    ("key", "value", "cure"),
    [
        ("max_rate_hz", "5", "remove it, or write max_rate_hz in `safety`, which bounds the questions"),
        ("latch", "true", "remove it: an answer is for the one who asked"),
    ],
)
def test_what_bounds_messages_to_everybody_has_no_meaning_where_nothing_else_is_sent(
    told: Callable[[str], list[str]], key: str, value: str, cure: str
) -> None:
    assert told(f"{{ type: measure, label: a, delivery: {{ {key}: {value} }} }}") == [
        f"connectors[0].delivery.{key}: connector 'a' answers requests, for which '{key}' of a delivery has no "
        f"meaning ({cure})"
    ]
    assert told(f"{{ type: both, label: a, delivery: {{ {key}: {value} }} }}") == []


@pytest.mark.parametrize("mode", ["latest", "bulk"])
def test_no_request_may_be_lost(told: Callable[[str], list[str]], mode: str) -> None:
    assert told(f"{{ type: measure, label: a, delivery: {mode} }}") == [
        f"connectors[0].delivery: connector 'a' answers requests, of which none may be lost: '{mode}' can't be "
        "(remove `delivery`, or choose `reliable`)"
    ]


def test_what_bounds_questions_and_answers_is_fine(told: Callable[[str], list[str]]) -> None:
    rest = "safety: { requires_lease: true, max_rate_hz: 5 }, delivery: { queue_messages: 9, queue_bytes: 4096 }"
    assert told(f"{{ type: measure, label: a, {rest} }}") == []
