"""What a person does with pictures in a real Chromium, down to what it changes on the robot and on disk: look away and
back, choose how they are buffered, save their figures, record.
"""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import av
import pytest
from playwright.sync_api import Browser, Locator, Page, expect
from support.people import wait_connected

pytestmark = pytest.mark.e2e

FPS = 15
CONNECTORS = """\
  - { type: test-pattern, label: front, params: { width: 320, height: 240, fps: 15 } }
  - { type: recorder, label: recorder, params: { labels: [front], directory: FOLDER, min_free_bytes: 0 } }
"""
KEEP_PEERS = """
window.peers = []
window.RTCPeerConnection = class extends RTCPeerConnection {
  constructor(...words) { super(...words); window.peers.push(this) }
}"""
BUFFER_TARGETS = """() => window.peers
  .flatMap((peer) => peer.getReceivers())
  .filter(({ track }) => track.kind === 'video' && !track.muted)
  .map(({ jitterBufferTarget }) => jitterBufferTarget)"""
BECOME = """(state) => {
  Object.defineProperty(document, 'visibilityState', { configurable: true, get: () => state })
  document.dispatchEvent(new Event('visibilitychange'))
}"""
DECODED = """async () => {
  const reports = await Promise.all(window.peers.map((peer) => peer.getStats()))
  return reports.flatMap((report) => [...report.values()])
    .reduce((sum, { type, framesDecoded }) => sum + (type === 'inbound-rtp' ? framesDecoded ?? 0 : 0), 0)
}"""
COME_ON = """() => new Promise((resolve) => {
  const video = document.querySelector('video')
  let pictures = 0
  const count = () => ++pictures === 3 ? resolve(true) : video.requestVideoFrameCallback(count)
  video.requestVideoFrameCallback(count)
})"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("recordings")


@pytest.fixture(scope="module")
def robot(start_robot: Any, folder: Path) -> Any:
    return start_robot(CONNECTORS.replace("FOLDER", str(folder)), wait=False)


@pytest.fixture(scope="module")
def page(browser: Browser, server: Any, seed: Any, sign_in: Callable[[Page], None], robot: Any) -> Iterator[Page]:
    """A signed-in person's page with the picture, kept for all tests."""
    context = browser.new_context(viewport={"width": 1280, "height": 900})
    context.add_init_script(KEEP_PEERS)
    opened = context.new_page()
    opened.set_default_timeout(20_000)
    sign_in(opened)
    opened.goto(f"{server.url}/robots/{seed.robot_id}")
    wait_connected(opened)
    opened.evaluate(COME_ON)
    yield opened
    context.close()


@pytest.fixture
def tools(page: Page) -> Locator:
    return page.get_by_role("group", name="Tools for front")


def viewers(snapshot: dict[str, Any]) -> int:
    (front,) = (one for one in snapshot["connectors"] if one["label"] == "front")
    return int(front["peers"])


@contextmanager
def scrolled_away(page: Page) -> Iterator[None]:
    page.set_viewport_size({"width": 700, "height": 300})
    page.evaluate("document.body.style.paddingBottom = '2000px'")
    page.mouse.move(300, 150)
    page.mouse.wheel(0, 2000)
    page.wait_for_function("() => document.querySelector('video').getBoundingClientRect().bottom < -200")
    yield
    page.mouse.wheel(0, -2000)
    page.evaluate(COME_ON)
    page.evaluate("document.body.style.paddingBottom = ''")
    page.set_viewport_size({"width": 1280, "height": 900})


def test_a_picture_that_is_scrolled_away_is_not_sent_and_comes_back(page: Page, robot: Any) -> None:
    robot.wait_for(lambda snapshot: viewers(snapshot) == 1, "the page watches")
    with scrolled_away(page):
        robot.wait_for(lambda snapshot: viewers(snapshot) == 0, "nobody watches what is scrolled away")
        expect(page.get_by_text("It is not on the screen.")).to_have_count(1)
    robot.wait_for(lambda snapshot: viewers(snapshot) == 1, "the page watches again")


def test_a_picture_that_is_recorded_here_comes_on_while_it_is_scrolled_away(
    page: Page, tools: Locator, tmp_path: Path, wait_for: Callable[..., float]
) -> None:
    tools.get_by_role("button", name="Record here, in this browser").click()
    with scrolled_away(page):
        begun = page.evaluate(DECODED)
        wait_for(lambda: page.evaluate(DECODED) > begun + 2 * FPS, "pictures come on")
    with page.expect_download() as download:
        tools.get_by_role("button", name="End the recording and save it").click()
    download.value.save_as(tmp_path / "here.webm")
    with av.open(tmp_path / "here.webm") as movie:
        assert len(list(movie.decode(video=0))) > FPS


def test_a_hidden_page_is_sent_no_picture_until_it_is_seen_again(page: Page, robot: Any) -> None:
    page.evaluate(BECOME, "hidden")
    robot.wait_for(lambda snapshot: viewers(snapshot) == 0, "nobody watches on a hidden page")
    page.evaluate(BECOME, "visible")
    page.evaluate(COME_ON)
    robot.wait_for(lambda snapshot: viewers(snapshot) == 1, "the page watches again")


def test_the_browser_holds_pictures_back_as_long_as_the_person_chose(page: Page, tools: Locator) -> None:
    assert page.evaluate(BUFFER_TARGETS) == [0]
    for choice, target_ms in (("Inspect", 250), ("Automatic", None), ("Drive", 0)):
        tools.get_by_role("button", name="More for front").click()
        page.get_by_role("menuitem", name=choice).click()
        page.wait_for_function(f"(target) => ({BUFFER_TARGETS})()[0] === target", arg=target_ms)


def test_the_figures_are_saved_as_files_that_programs_read(page: Page, tools: Locator, tmp_path: Path) -> None:
    tools.get_by_role("button", name="Show all figures").click()
    expect(page.get_by_test_id("picture-facts")).to_contain_text("bit/s")  # so a second has been measured
    saved = {}
    for kind in ("CSV", "JSON"):
        tools.get_by_role("button", name="More for front").click()
        with page.expect_download() as download:
            page.get_by_role("menuitem", name=f"Save as {kind}").click()
        assert download.value.suggested_filename == f"picture_front.{kind.lower()}"
        saved[kind] = tmp_path / kind
        download.value.save_as(saved[kind])
    with saved["CSV"].open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert {row["width_px"] for row in rows if row["state"] == "live"} >= {"320"}
    seconds = [float(row["t_s"]) for row in rows]
    assert seconds == sorted(seconds)
    records = json.loads(saved["JSON"].read_text())["records"]
    assert [record["t_s"] for record in records[: len(rows)]] == seconds


def test_what_the_recorders_buttons_record_on_the_robot_plays(page: Page, folder: Path) -> None:
    card = page.get_by_role("group", name="Recorder recorder")
    card.get_by_role("button", name="Record").click()
    row = page.get_by_role("listitem").filter(has_text="front")
    expect(row).to_contain_text(re.compile("recording · 0:0[1-9]"), timeout=15_000)
    card.get_by_role("button", name="End").click()
    expect(card.get_by_role("button", name="Record")).to_be_visible(timeout=15_000)
    (path,) = folder.glob("*.mp4")
    with av.open(path) as movie:
        pictures = [frame.to_ndarray(format="rgb24") for frame in movie.decode(video=0)]
    assert len(pictures) >= 10
    assert {picture.shape for picture in pictures} == {(240, 320, 3)}
    assert (pictures[0] != pictures[-1]).any()
