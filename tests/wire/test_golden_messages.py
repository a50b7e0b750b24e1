"""The golden messages: Python reads and re-emits each exactly; ``dashboard/packages/protocol`` does the same."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from mosaic_core.words.control import CONTROL_MESSAGES, parse_control
from mosaic_core.words.errors import WireError
from mosaic_core.words.signaling import MESSAGES, UnknownMessage, parse_signaling

HERE = Path(__file__).parent
SPECIAL = {
    "arrivals.json", "frames.json", "malformed.json", "original_types.json", "reassembly.json", "resume.json",
}  # fmt: skip


def golden_cases() -> list[Any]:
    paths = [path for path in sorted(HERE.glob("*.json")) if path.name not in SPECIAL]
    documents = [(path.stem, json.loads(path.read_text())) for path in paths]
    return [
        pytest.param(document["socket"], case, id=f"{stem}: {case['name']}")
        for stem, document in documents
        for case in document["cases"]
    ]


def reemitted(socket: str, text: str) -> Any:
    message = parse_signaling(text) if socket == "signaling" else parse_control(text)
    assert message is not None
    assert not isinstance(message, UnknownMessage)
    return json.loads(message.to_text())


@pytest.mark.parametrize(("socket", "case"), golden_cases())
def test_a_golden_message_is_read_and_emitted_again(socket: str, case: dict[str, Any]) -> None:
    expected = case.get("reads_as", case["wire"])
    assert reemitted(socket, json.dumps(case["wire"])) == expected


@pytest.mark.parametrize(("socket", "case"), golden_cases())
def test_what_is_emitted_reads_as_itself(socket: str, case: dict[str, Any]) -> None:
    expected = case.get("reads_as", case["wire"])
    assert reemitted(socket, json.dumps(expected)) == expected


@pytest.mark.parametrize("text", json.loads((HERE / "malformed.json").read_text())["signaling"])
def test_a_malformed_signaling_message_is_refused(text: str) -> None:
    with pytest.raises(WireError):
        parse_signaling(text)


@pytest.mark.parametrize("text", json.loads((HERE / "malformed.json").read_text())["control"])
def test_a_malformed_control_message_is_refused(text: str) -> None:
    with pytest.raises(WireError):
        parse_control(text)


def test_every_message_has_its_golden_file() -> None:
    signaling = {word if word.startswith("signaling") else f"signaling.{word}" for word in MESSAGES}
    control = {f"control.{word}" for word in CONTROL_MESSAGES}
    files = {path.name.removesuffix(".json") for path in HERE.glob("*.json") if path.name not in SPECIAL}
    assert files == signaling | control | {"signaling.authorize.res", "signaling.error-echo"}
