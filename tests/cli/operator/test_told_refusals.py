"""What the terminal tells of refusals: each code of each gate once, in the journal whole at the usual width."""

from __future__ import annotations

import pytest

from mosaic_core.cli.operator.control_actions import show_entries
from mosaic_core.cli.operator.operator_send import SendAction, refusal_text
from mosaic_core.words.control import JournalEntry, Refusal


def test_each_code_of_each_gate_is_told_once_and_the_rest_is_counted(capsys: pytest.CaptureFixture[str]) -> None:
    stopped = [Refusal(label="drive", code="safety.stopped", gate="stop") for _ in range(4)]
    held = [Refusal(label="drive", code="safety.release_first", gate="stop", count=2) for _ in range(3)]
    late = [Refusal(label="drive", code="safety.stopped", gate="act")]
    SendAction("robot", "drive", "{}", 0.1, 1.0)._report(20, [*stopped, *held, *late])
    told = capsys.readouterr()
    lines = told.err.splitlines()
    assert [line.split(": ")[0:2] for line in lines[:3]] == [
        ["refused at the gate stop", "safety.stopped"],
        ["refused at the gate stop", "safety.release_first"],
        ["refused at the gate act", "safety.stopped"],
    ]
    assert lines[3:] == ["refused in all: 5 × safety.stopped, 6 × safety.release_first"]
    assert told.out == "20 sent, 11 refused\n"


def test_the_journal_shows_time_code_and_gate_whole_at_80_columns(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.setenv("TTY_COMPATIBLE", "1")
    monkeypatch.setenv("TERM", "dumb")
    entry = JournalEntry(
        number=1, at="2026-01-31T12:00:00.123+00:00", what="command.refused", who="a.long.name@robots.example.org",
        subject="the/arm/on/the/left", code="lease.original_observes", gate="sequence", message="rpm: Field required",
    )  # fmt: skip
    show_entries([entry], as_json=False)
    shown = capsys.readouterr().out
    for whole in ("2026-01-31T12:00:00.123", "command.refused", "lease.original_observes", "at the gate sequence"):
        assert whole in shown
    assert "…" not in shown
    assert max(map(len, shown.splitlines())) <= 80


@pytest.mark.parametrize(
    ("message", "told"),
    [
        ("no field 'linera': did you mean 'linear'?", "did you mean 'linear'? Compare it with"),
        ("rpm: Field required", "rpm: Field required. Compare it with"),
        ("It is no JSON.", "It is no JSON. Compare it with"),
    ],
)
def test_what_is_refused_is_told_as_one_sentence_before_the_cure(message: str, told: str) -> None:
    assert told in refusal_text(Refusal(label="drive", code="channel.invalid", gate="shape", message=message))
