"""The table without rich: whole rows for programs, folded ones for people."""

from __future__ import annotations

import sys

import pytest

from mosaic_core.cli.terminal.plain_table import print_table

ROWS = [("camera", "pictures of a device, a file or a network stream", "1.0"), ("gps", "", "12.0.1")]


def printed(capsys: pytest.CaptureFixture[str]) -> list[str]:
    print_table(("type", "description", "version"), ROWS, folded=1)
    return capsys.readouterr().out.splitlines()


def test_in_a_pipe_every_row_is_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    heading, *rows = printed(capsys)
    assert len(rows) == len(ROWS)
    assert rows[0] == "camera  pictures of a device, a file or a network stream  1.0"
    assert heading.index("version") == rows[0].index("1.0") == rows[1].index("12.0.1")


def test_on_a_narrow_terminal_the_longest_column_is_folded(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True, raising=False)
    monkeypatch.setenv("COLUMNS", "40")
    _, *rows = printed(capsys)
    assert rows[:3] == ["camera  pictures of a device, a  1.0", "        file or a network", "        stream"]
    assert all(len(row) <= 40 for row in rows)
