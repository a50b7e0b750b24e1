"""The golden steps of resuming senders and receivers: Python and TypeScript do the same."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from mosaic_core.machines.delivery.resume import ResumeLimits, ResumeReceiver, ResumeSender

GOLDEN = json.loads((Path(__file__).parent / "resume.json").read_text())


def done(sender: ResumeSender[str], step: dict[str, Any]) -> Any:
    if step["do"] != "send":
        return getattr(sender, step["do"])(*step["with"])
    message = sender.upcoming()
    if message is None:
        return None
    sender.went_out()
    return [message.seq, message.item, message.is_repeated]


@pytest.mark.parametrize("case", [pytest.param(case, id=case["name"]) for case in GOLDEN["senders"]])
def test_a_sender_does_its_golden_steps(case: dict[str, Any]) -> None:
    sender: ResumeSender[str] = ResumeSender(ResumeLimits(**GOLDEN["limits"]))
    for step in case["steps"]:
        assert done(sender, step) == step["gives"], step
        assert {name: getattr(sender, name) for name in step["then"]} == step["then"], step


@pytest.mark.parametrize("case", [pytest.param(case, id=case["name"]) for case in GOLDEN["receivers"]])
def test_a_receiver_does_its_golden_steps(case: dict[str, Any]) -> None:
    receiver = ResumeReceiver(case["received"])
    for step in case["steps"]:
        given = getattr(receiver, step["do"])(*step["with"])
        if step["do"] == "arrived":
            given = [given.is_new, given.lost]
        assert given == step["gives"], step
        assert {name: getattr(receiver, name) for name in step["then"]} == step["then"], step
