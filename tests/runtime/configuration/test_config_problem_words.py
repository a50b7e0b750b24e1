"""One mistake is told once, in words."""

from __future__ import annotations

from typing import Any

import pytest

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
