"""`mosaic doctor --only`: a group that isn't there is told with the nearest, before anything is examined."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest


def test_an_unknown_group_is_told_with_all_that_there_are(mosaic: Callable[..., Any]) -> None:
    ended = mosaic("doctor", "--only", "wibble")
    assert ended.code == 2
    assert "no group of checks 'wibble'" in ended.err
    assert "There are: machine, install, network, server, ice" in ended.err


def test_a_misspelt_group_is_told_with_the_nearest_also_beside_a_known_one(mosaic: Callable[..., Any]) -> None:
    ended = mosaic("doctor", "--only", "machine", "--only", "servr")
    assert ended.code == 2
    assert "did you mean 'server'?" in ended.err


@pytest.mark.parametrize(("group", "needs"), [("code", "the robot's YAML file"), ("whole", "--with-server")])
def test_a_group_that_needs_more_says_what(mosaic: Callable[..., Any], group: str, needs: str) -> None:
    ended = mosaic("doctor", "--only", group)
    assert (ended.code, ended.err.strip()) == (2, f"error: --only {group} needs {needs}")


def test_only_the_source_of_connectors_that_the_file_names_is_read(
    mosaic: Callable[..., Any], robot_yaml: Path
) -> None:
    robot_yaml.write_text(robot_yaml.read_text() + "  - { type: host-load, label: host }\n")
    ended = mosaic("doctor", str(robot_yaml), "--only", "code", "--json")
    assert (ended.code, "mosaic_sensors" in ended.out, "mosaic_audio" in ended.out) == (0, True, False)


def test_without_a_word_the_file_of_this_folder_is_examined_with_the_code_beside_it(
    mosaic: Callable[..., Any], robot_yaml: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    robot_yaml.with_name("mosaic_config.yaml").write_text("connectors: [{type: lamp, label: lamp}]\n")
    robot_yaml.with_name("connectors").mkdir()
    (robot_yaml.parent / "connectors" / "lamp.py").write_text("lamp = (")
    monkeypatch.chdir(robot_yaml.parent)
    ended = mosaic("doctor", "--only", "config", "--json", "--local-connectors")
    assert ended.code == 1
    assert "mosaic_config.yaml:1: connectors[0].type: no connector type 'lamp'" in ended.out
    assert "lamp.py:1: SyntaxError" in ended.out


@pytest.mark.parametrize("word", ["--local-connectors", "--no-local-connectors"])
def test_a_word_about_code_beside_a_file_needs_one(
    mosaic: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, word: str
) -> None:
    monkeypatch.chdir(tmp_path)
    ended = mosaic("doctor", "--only", "machine", word)
    assert (ended.code, ended.err) == (
        2,
        f"error: {word} is about code beside the robot's YAML file, and there is no mosaic_config.yaml here\n",
    )
