"""The site that tests look at is the one of the pages as they are now."""

from __future__ import annotations

import os
from pathlib import Path
from subprocess import CompletedProcess
from typing import Any

import pytest
from support import built_site


@pytest.fixture
def builds(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """A page, a site that is a minute older, and the exit code of each build."""
    (tmp_path / "docs").mkdir()
    (tmp_path / "docs" / "page.md").write_text("# A page")
    site = tmp_path / "site"
    site.mkdir()
    (site / "sitemap.xml").touch()
    old_s = (site / "sitemap.xml").stat().st_mtime - 60
    os.utime(site / "sitemap.xml", (old_s, old_s))
    codes: list[int] = []

    def run(*_words: Any, **_how: Any) -> CompletedProcess[str]:
        (site / "sitemap.xml").touch()
        codes.append(0)
        return CompletedProcess([], 0, "", "")

    for name, value in (("ROOT", tmp_path), ("SITE", site), ("LAST", site / "sitemap.xml"), ("MADE_OF", ("docs",))):
        monkeypatch.setattr(built_site, name, value)
    monkeypatch.setattr(built_site.subprocess, "run", run)
    return codes


def test_a_site_that_is_older_than_a_page_is_built_and_then_taken_as_it_is(builds: list[int]) -> None:
    for _ in range(2):
        assert built_site.built_site() == built_site.SITE
    assert builds == [0]


def test_a_site_that_could_not_be_built_is_none(builds: list[int], monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(*_words: Any, **_how: Any) -> CompletedProcess[str]:
        builds.append(1)
        return CompletedProcess([], 1, "a warning", "")

    monkeypatch.setattr(built_site.subprocess, "run", fails)
    for _ in range(2):
        with pytest.raises(AssertionError, match="a warning"):
            built_site.built_site()
    assert builds == [1, 1]
