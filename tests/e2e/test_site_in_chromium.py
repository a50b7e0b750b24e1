"""The site of the documentation as people see it: it fits on a phone, diagrams are drawn, and all can be read."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, Page
from support.accessibility import AXE, BAD, DESKTOP, EXAMINE
from support.built_site import built_site

pytestmark = [pytest.mark.e2e, pytest.mark.timeout(600)]

ROOT = Path(__file__).parents[2]
PAGES = sorted(path.relative_to(ROOT / "docs").with_suffix("") for path in (ROOT / "docs").rglob("*.md"))
EXAMINED = ("", "tutorial/real-robot/", "howto/ros2/", "reference/python-connectors/", "topics/safety/")
"""One of each kind: pictures, steps, wide tables, the reference, diagrams."""
NARROW: Any = {"width": 360, "height": 740}
FITS = "() => document.documentElement.scrollWidth <= innerWidth"
DRAWN = "() => document.querySelector('pre.mermaid') === null"
"""The theme puts another element in the place of what it has drawn."""


class Quiet(SimpleHTTPRequestHandler):
    def log_message(self, *words: object) -> None: ...


@pytest.fixture(scope="module")
def site() -> Iterator[str]:
    """Its address."""
    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(Quiet, directory=str(built_site())))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{server.server_port}/"
    server.shutdown()
    server.server_close()


@pytest.fixture
def tab(browser: Browser) -> Iterator[tuple[Page, list[str]]]:
    """A page, and what its scripts complain about."""
    context = browser.new_context(viewport=NARROW)
    page, complaints = context.new_page(), list[str]()
    page.on("pageerror", lambda error: complaints.append(f"{page.url}: {error}"))
    page.on("response", lambda one: complaints.append(f"{page.url} lacks {one.url}") if one.status >= 400 else None)
    yield page, complaints
    context.close()


def test_no_page_sticks_out_of_a_phone_and_diagrams_are_drawn(site: str, tab: tuple[Page, list[str]]) -> None:
    page, complaints = tab
    for path in PAGES:
        page.goto(f"{site}{path}/".removesuffix("index/"), wait_until="domcontentloaded")
        page.wait_for_function(DRAWN)
        page.wait_for_function(FITS)  # once wide tables have become ones that scroll
    assert complaints == []


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_who_sees_badly_or_has_no_mouse_can_read_it(site: str, tab: tuple[Page, list[str]], scheme: Any) -> None:
    page, complaints = tab
    page.emulate_media(color_scheme=scheme)
    for path in EXAMINED:
        page.goto(site + path)
        page.wait_for_function(DRAWN)
        page.evaluate(AXE.read_text())
        for size in (NARROW, DESKTOP):
            page.set_viewport_size(size)
            problems = [what for impact, what in page.evaluate(EXAMINE, "html") if impact in BAD]
            assert problems == [], f"{path} {scheme} {size}"
    assert complaints == []
