"""Cameras in a real Chromium, by the marks in their displayed pictures: every codec is decoded, every picture stands at
its own label, many viewers cost one encoder, and who comes late sees a picture at once.
"""

from __future__ import annotations

import json
import re
import signal
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from itertools import islice, pairwise
from pathlib import Path
from statistics import median
from typing import Any

import pytest
from playwright.sync_api import Browser, Page, expect
from support.people import photographed
from support.processes import Process
from support.robot_process import write_config

pytestmark = [pytest.mark.e2e, pytest.mark.timeout(180)]

BENCH = Path(__file__).parents[2] / "bench" / "glass_bench"
CONNECTORS = """\
  - { type: test-pattern, label: front, params: { width: 640, height: 360, fps: 24, codec: vp8 } }
  - { type: test-pattern, label: rear, params: { width: 320, height: 240, fps: 12, codec: h264 } }
"""
FRONT_SHAPE, REAR_SHAPE = 640 / 360, 320 / 240
STRETCHES = 4
FREEZE_MS = 500
"""Longer than the bench's limit: the machine of a test may be busy."""
LATE_JOINER_PICTURES = 5 * 24
"""So many the others are shown meanwhile at most: 5 s of the camera, and more on a machine that has other work."""
AGE_TOLERANCE_MS = 30
"""The bench has it to the millisecond; here, a text of a busy page is compared that changes four times a second."""
WATCH = """(label) => {
  const video = document.querySelector(`video[aria-label="Picture of ${label}"]`)
  const seen = ((window.seen ??= {})[label] = [])
  const note = (_, { expectedDisplayTime }) => {
    const marks = window.readMarks(video)
    if (marks) seen.push([expectedDisplayTime, marks.frame, marks.ticks, video.videoWidth / video.videoHeight])
    video.requestVideoFrameCallback(note)
  }
  video.requestVideoFrameCallback(note)
}"""

KEPT = """(label) => {
  const canvas = document.querySelector(`section[data-label="${label}"] [data-testid="kept-picture"] canvas`)
  const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height)
  return { shape: canvas.width / canvas.height, isDrawn: new Set(data).size > 2 }
}"""
"""The shape of the picture that was kept, and whether it shows anything."""


class CountedRobot(Process):
    """`mosaic run` that says which encoders it runs."""

    def __init__(self, config: Path) -> None:
        super().__init__([sys.executable, str(BENCH / "counted_robot.py"), str(config)])
        self.encoders: list[str] = []
        """Labels, one per encoder, as of a quarter of a second ago."""

    def read_line(self, line: str) -> None:
        if line.startswith("{"):
            self.encoders = list(json.loads(line)["encoders"])


@pytest.fixture(scope="module")
def camera_robot(server: Any, seed: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[CountedRobot]:
    ws_url = f"ws://127.0.0.1:{server.port}"
    robot = CountedRobot(write_config(tmp_path_factory.mktemp("camera_robot"), ws_url, seed, CONNECTORS))
    robot.start()
    yield robot
    robot.stop()


@contextmanager
def viewer(browser: Browser, server: Any, seed: Any, sign_in: Callable[[Page], None]) -> Iterator[Page]:
    """A signed-in person's page with both pictures."""
    context = browser.new_context(viewport={"width": 1280, "height": 1600})
    page = context.new_page()
    page.set_default_timeout(30_000)
    sign_in(page)
    page.goto(f"{server.url}/robots/{seed.robot_id}")
    for label in ("front", "rear"):
        page.wait_for_function(f"() => document.querySelector('video[aria-label=\"Picture of {label}\"]')?.videoWidth")
    page.evaluate((BENCH / "marks.js").read_text())
    for label in ("front", "rear"):
        page.evaluate(WATCH, label)
    yield page
    context.close()


def newest(page: Page, label: str, count: int) -> list[list[float]]:
    """The last ``count`` pictures, as soon as there were so many: display time in ms, frame, tenths of a millisecond
    of capture, shape."""
    page.wait_for_function("([label, count]) => window.seen[label].length >= count", arg=[label, count])
    pictures: list[list[float]] = page.evaluate("([label, count]) => window.seen[label].slice(-count)", [label, count])
    return pictures


def following(page: Page, label: str, count: int) -> list[list[float]]:
    """The next ``count`` pictures."""
    page.evaluate("(label) => { window.seen[label].length = 0 }", label)
    return newest(page, label, count)


def stretches(page: Page, label: str, count: int) -> Iterator[list[list[float]]]:
    yield newest(page, label, count)
    while True:
        yield following(page, label, count)


def source_fps(pictures: list[list[float]]) -> float:
    """Of the source, by the marks alone, however many pictures were left out."""
    (_, first_frame, first_ticks, _), (_, last_frame, last_ticks, _) = pictures[0], pictures[-1]
    return (last_frame - first_frame) / ((last_ticks - first_ticks) / 10_000)


def page_offsets_s(page: Page, looks: int) -> Iterator[tuple[float, float]]:
    """(how long the page took to answer, our monotonic clock less the page's)"""
    for _ in range(looks):
        asked_s = time.monotonic()
        page_ms = page.evaluate("performance.now()")
        answered_s = time.monotonic()
        yield answered_s - asked_s, (asked_s + answered_s) / 2 - page_ms / 1000


def freezes(pictures: list[list[float]]) -> int:
    times = [picture[0] for picture in pictures]
    return sum(late - early > FREEZE_MS for early, late in pairwise(times))


def codec(page: Page, label: str) -> str:
    """As the dashboard says."""
    tools = page.get_by_role("group", name=f"Tools for {label}")
    tools.get_by_role("button", name="Show all figures").click()
    facts = page.get_by_test_id("video").filter(has=tools).get_by_test_id("picture-facts")
    facts.get_by_text("Bit rate:").filter(has_text="bit/s, ").wait_for()
    line = next(line for line in facts.inner_text().splitlines() if line.startswith("Bit rate:"))
    tools.get_by_role("button", name="Hide the figures").click()
    return line.rpartition(", ")[2]


@pytest.fixture(scope="module")
def page(browser: Browser, server: Any, seed: Any, sign_in: Any, camera_robot: CountedRobot) -> Iterator[Page]:
    with viewer(browser, server, seed, sign_in) as first:
        yield first


@pytest.mark.parametrize(("label", "name"), [("front", "VP8"), ("rear", "H264")])
def test_chromium_decodes_every_codec_that_is_offered(page: Page, label: str, name: str) -> None:
    assert codec(page, label) == name
    tries = islice(stretches(page, label, 48), STRETCHES)
    pictures = next((pictures for pictures in tries if freezes(pictures) <= 1), None)
    assert pictures is not None, "a busy machine stalls now and then, a broken stream always does"
    assert len({picture[1] for picture in pictures}) > 40, "it is the same picture over and over"


def test_each_camera_stands_at_its_own_label(page: Page) -> None:
    front, rear = newest(page, "front", 20), newest(page, "rear", 20)
    assert front[-1][3] == pytest.approx(FRONT_SHAPE, abs=0.02)
    assert rear[-1][3] == pytest.approx(REAR_SHAPE, abs=0.02)
    assert source_fps(front) > 1.3 * source_fps(rear)


def test_the_age_over_the_picture_is_the_one_that_is_burnt_into_it(page: Page) -> None:
    offset_s = min(page_offsets_s(page, 20))[1]
    facts = page.get_by_test_id("video").first.get_by_test_id("picture-facts")
    newest(page, "front", 48)
    shown_ms, now_ms, pictures = page.evaluate(
        "(facts) => [parseFloat(facts.textContent), performance.now(), window.seen.front]", facts.element_handle()
    )
    last_second = [picture for picture in pictures if now_ms - 1000 < picture[0] <= now_ms]
    burnt_in_ms = median(picture[0] + 1000 * offset_s - picture[2] / 10 for picture in last_second)
    assert shown_ms == pytest.approx(burnt_in_ms, abs=AGE_TOLERANCE_MS)


def test_several_viewers_cost_one_encoder_and_who_comes_late_sees_a_picture(
    page: Page,
    browser: Browser,
    server: Any,
    seed: Any,
    sign_in: Any,
    camera_robot: CountedRobot,
    wait_for: Callable[..., float],
) -> None:
    with ExitStack() as stack:
        others = [stack.enter_context(viewer(browser, server, seed, sign_in)) for _ in range(2)]
        for one in (page, *others):
            following(one, "front", 10)
        # While a viewer changes to another rung there are two for a moment.
        wait_for(lambda: camera_robot.encoders == ["front", "rear"], "one encoder for each camera", 30)
        late = others[-1]
        page.evaluate("() => { window.seen.front.length = 0 }")
        late.reload()
        late.wait_for_function("() => [...document.querySelectorAll('video')].filter((v) => v.videoWidth).length === 2")
        assert page.evaluate("() => window.seen.front.length") < LATE_JOINER_PICTURES
    wait_for(lambda: camera_robot.encoders == ["front", "rear"], "the others' encoders go on", 30)
    assert len(following(page, "front", 10)) >= 10


def test_while_the_robot_is_away_its_last_picture_stays_gray_with_its_age(
    page: Page, camera_robot: CountedRobot
) -> None:
    front = page.locator("section[data-label=front]")
    camera_robot.process.send_signal(signal.SIGSTOP)
    try:
        expect(front.get_by_test_id("video")).to_have_attribute("data-state", "reconnecting", timeout=20_000)
        # First any age, then one that only time can have brought.
        for age in (r"[\d.]+", r"([4-9]\.\d|\d\d)"):
            expect(front.get_by_role("status")).to_have_text(re.compile(f"Reconnecting · last picture {age} s old"))
        kept = page.evaluate(KEPT, "front")
        assert kept["isDrawn"]
        assert kept["shape"] == pytest.approx(FRONT_SHAPE, abs=0.02)
        photographed(page, "away")
    finally:
        camera_robot.process.send_signal(signal.SIGCONT)
    following(page, "front", 10)
    expect(front.get_by_test_id("kept-picture")).to_have_count(0)
