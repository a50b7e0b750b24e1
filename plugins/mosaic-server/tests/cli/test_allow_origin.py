"""What `--allow-origin` takes: an origin, as browsers send it."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner

from mosaic_server.cli import app
from mosaic_server.web.origins import origin_in


@pytest.mark.parametrize(
    ("text", "origin"),
    [
        ("http://localhost:5391", "http://localhost:5391"),
        ("http://localhost:5391/", "http://localhost:5391"),
        ("HTTPS://Page.Example.org", "https://page.example.org"),
        ("https://page.example.org:443/", "https://page.example.org"),
        ("http://[::1]:5173", "http://[::1]:5173"),
    ],
)
def test_an_origin_becomes_what_browsers_send(text: str, origin: str) -> None:
    assert origin_in(text) == origin


@pytest.mark.parametrize(
    "text", ["localhost:5391", "page.example.org", "*", "ws://a.b", "http://", "http://a.b:port", "http://u@a.b"]
)
def test_what_no_browser_sends_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match=r".+"):
        origin_in(text)


def test_the_server_does_not_start_for_a_page_with_a_path_and_says_what_to_write(tmp_path: Path) -> None:
    words = ["run", "--data-dir", str(tmp_path), "--allow-origin", "http://localhost:5391/dashboard"]
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 2
    assert "an origin has no path: write http://localhost:5391" in " ".join(done.output.split())
