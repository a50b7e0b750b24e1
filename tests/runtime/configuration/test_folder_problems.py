"""Folders that two connectors would both have to themselves are told with both lines."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from mosaic_core.runtime.configuration.auto_configurer import Rehearsal

Rehearsed = Callable[..., Rehearsal]


def films(label: str, folder: object) -> str:
    return f"type: watcher, label: {label}, params: {{ films: {folder} }}"


def test_a_second_connector_with_the_same_folder_is_told_with_both_lines(rehearsed: Rehearsed) -> None:
    (problem,) = rehearsed(films("a", "/films"), films("b", "/other"), films("c", "/films/../films/")).problems
    assert (problem.line, problem.path) == (8, "connectors[2].params.films")
    assert problem.message == "connector 'c' has the folder of connector 'a' (line 6): /films/../films/"
    assert problem.cure == "give each a folder of its own"


def test_a_folder_under_two_names_is_one(rehearsed: Rehearsed, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "films").mkdir()
    (tmp_path / "link").symlink_to(tmp_path / "films")
    monkeypatch.setenv("HOME", str(tmp_path))
    (problem,) = rehearsed(films("a", "~/films"), films("b", tmp_path / "link")).problems
    assert problem.path == "connectors[1].params.films"


def test_who_names_no_folder_or_one_of_its_own_may_stay(rehearsed: Rehearsed) -> None:
    unnamed = ("type: watcher, label: a", "type: watcher, label: b")
    assert not rehearsed(*unnamed, films("c", "/c"), films("d", "/d")).problems
