"""A handler from which nothing can come is told, with what was written under another name."""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from mosaic_core.runtime.configuration.mistakes.silent_hints import silent_hints
from mosaic_core.words.errors import Problem

HEAD = """
from mosaic_core import AudioReceivable, AudioTrackHandler, DataChannelBidirectional, DataChannelReceivable
from mosaic_core import DataChannelSendable, MediaTrackHandler
"""


TAKES = "class H(DataChannelReceivable[dict]):\n    def handle_data(self, data):"


class Place:
    """Of the connector in its file."""

    def problem(self, message: str, *key: str, cure: str = "") -> Problem:
        return Problem(message, cure=cure)


@pytest.fixture
def hints(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[str], list[Problem]]:
    def of(code: str) -> list[Problem]:
        file = tmp_path / "acme_silent.py"
        file.write_text(HEAD + code)
        spec = importlib.util.spec_from_file_location("acme_silent", file)
        assert spec is not None
        assert spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        monkeypatch.setitem(sys.modules, "acme_silent", module)
        spec.loader.exec_module(module)
        one: Any = Place()
        return [*silent_hints(one, (module.H("it"),))]

    return of


@pytest.mark.parametrize(
    ("base", "method", "told"),
    [
        ("DataChannelSendable[dict]", "run", "H has no messages(), and nobody calls its run()"),
        ("MediaTrackHandler", "get_frame", "H has no frames(), and nobody calls its get_frame()"),
        ("AudioTrackHandler", "record", "H has no sounds(), and nobody calls its record()"),
        ("AudioReceivable", "play", "H has no handle_sound(), and nobody calls its play()"),
        ("MediaTrackHandler", "_get", "H has no frames()"),
    ],
)
def test_a_body_under_another_name_is_told(
    hints: Callable[[str], list[Problem]], tmp_path: Path, base: str, method: str, told: str
) -> None:
    (hint,) = hints(f"class H({base}):\n    def {method}(self): yield 1\n")
    assert hint.message == f"nothing comes from 'it': {told}"
    assert hint.cure.endswith(f" in H ({tmp_path}/acme_silent.py:4)")


@pytest.mark.parametrize(
    ("code", "told"),
    [
        (
            "class H(DataChannelSendable[dict]):\n    def messages(self):\n        for _ in self.every(1): dict(x=1)\n",
            "messages() of H yields nothing",
        ),
        (
            "class H(DataChannelBidirectional[dict]):\n    def handle_data(self, data): return {'x': 1}\n",
            "what handle_data of H returns goes nowhere",
        ),
        (
            f"class Reply(dict): pass\n{TAKES} return Reply()\n",
            "what handle_data of H returns goes nowhere",
        ),
    ],
)
def test_what_runs_in_vain_is_told(hints: Callable[[str], list[Problem]], code: str, told: str) -> None:
    (hint,) = hints(code)
    assert hint.message == f"nothing comes from 'it': {told}"
    assert hint.cure


@pytest.mark.parametrize(
    "code",
    [
        "class H(DataChannelSendable[dict]):\n    def messages(self): return iter([{}])\n",
        "class H(DataChannelSendable[dict]):\n    async def messages(self):\n        yield {}\n",
        f"{TAKES} return self.turn(data)\n    turn = print\n",
        f"{TAKES}\n        if data: return None\n        return\n",
        "class H(DataChannelSendable[dict]):\n    def messages(self): yield {}\n",
        "class H(DataChannelSendable[dict]):\n    def hear(self, word): self.send_json({'word': word})\n",
        "class H(DataChannelBidirectional[dict]):\n    def handle_data(self, data): pass\n",
        "class H(DataChannelReceivable[dict]):\n    def handle_data(self, data): pass\n",
        "class H(MediaTrackHandler):\n    pass\ndef grab(handler): handler.send_frame(None)\n",
    ],
)
def test_what_has_a_body_or_is_sent_by_somebody_is_left_alone(hints: Callable[[str], list[Problem]], code: str) -> None:
    assert hints(code) == []
