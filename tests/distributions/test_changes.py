"""The files in `changes/` are what a changelog can be made of."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SETTINGS = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["towncrier"]
TYPES = [entry["directory"] for entry in SETTINGS["type"]]
NAME = re.compile(rf"\+[a-z0-9]+(-[a-z0-9]+)*\.({'|'.join(TYPES)})\.md")
FRAGMENTS = sorted(path for path in (ROOT / "changes").iterdir() if path.name not in SETTINGS["ignore"])


@pytest.mark.parametrize("path", FRAGMENTS, ids=lambda path: path.name)
def test_a_change_is_told_in_whole_sentences_under_a_name_that_says_its_type(path: Path) -> None:
    assert NAME.fullmatch(path.name), f"{path.name}: changes/README.md says how such a file is called"
    text = path.read_text()
    assert text.strip().endswith("."), "it ends with a full stop"
    assert text.endswith("\n")
    assert not re.search(r"^#", text, re.MULTILINE), "headings are made by the changelog"
    assert not text.startswith(("-", "*", " ")), "the changelog makes a list of it"


def test_the_readme_of_changes_has_every_type() -> None:
    told = re.findall(r"^\| `(\w+)`", (ROOT / "changes" / "README.md").read_text(), re.MULTILINE)
    assert told == TYPES


def test_the_changelog_has_the_place_where_releases_are_put() -> None:
    assert (ROOT / SETTINGS["filename"]).read_text().count(SETTINGS["start_string"]) == 1
