"""A point cloud in a real Chromium: decoded in the worker, drawn by WebGL, turned by hand; without WebGL it is said."""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Browser, Page, Playwright, expect
from support.people import photographed, wait_connected

pytestmark = [pytest.mark.e2e, pytest.mark.timeout(120)]

POINTS = 60_000
"""Enough for the worker, on a machine that draws with its processor."""
SOFTWARE_GRAPHICS = ["--headless=new", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
NO_GRAPHICS = ["--headless=new", "--no-sandbox", "--disable-gpu", "--disable-3d-apis"]


@pytest.fixture(scope="module")
def cloud_robot(start_robot: Any, tmp_path_factory: pytest.TempPathFactory) -> Any:
    angles = np.linspace(0, 40 * np.pi, POINTS)
    spiral = np.stack([4 * np.cos(angles), 4 * np.sin(angles), angles / 60], axis=1)
    path = tmp_path_factory.mktemp("cloud") / "spiral.npy"
    np.save(path, spiral.astype(np.float32))
    params = f"{{ source: {path}, rate_hz: 5 }}"
    return start_robot(f"  - {{ type: point-cloud, label: cloud, params: {params} }}\n", wait=False)


@contextmanager
def browsing(playwright: Playwright, chromium: str, flags: list[str]) -> Iterator[Browser]:
    running = playwright.chromium.launch(executable_path=chromium, args=flags)
    yield running
    running.close()


@contextmanager
def robot_page(browser: Browser, server: Any, seed: Any, sign_in: Callable[[Page], None]) -> Iterator[Page]:
    page = browser.new_context(viewport={"width": 1100, "height": 800}).new_page()
    page.set_default_timeout(30_000)
    errors: list[str] = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    sign_in(page)
    page.goto(f"{server.url}/robots/{seed.robot_id}")
    wait_connected(page)
    yield page
    page.context.close()
    assert not errors, errors


def drawn(page: Page) -> Any:
    """The picture's pixels, without what is written over its corner."""
    picture = Image.open(io.BytesIO(page.get_by_role("img", name="Point cloud cloud").screenshot()))
    pixels = np.asarray(picture.convert("RGB")).astype(int)
    return pixels[: int(len(pixels) * 0.9)]


def coloured_share(pixels: Any) -> float:
    """Of pixels that are no grey: neither panel nor grid."""
    return float((np.ptp(pixels, axis=2) > 60).mean())


def test_a_cloud_is_decoded_drawn_and_turned(
    playwright: Playwright,
    chromium: str,
    server: Any,
    seed: Any,
    sign_in: Any,
    cloud_robot: Any,
    wait_for: Callable[..., float],
) -> None:
    flags = SOFTWARE_GRAPHICS
    with browsing(playwright, chromium, flags) as browser, robot_page(browser, server, seed, sign_in) as page:
        if not page.evaluate("document.createElement('canvas').getContext('webgl2') !== null"):
            pytest.skip("this Chromium has no WebGL, not even in software")
        facts = page.get_by_text(re.compile(r"60,000 points · [\d.]+ Hz · \d+ KB · \d+ m?s"))
        expect(facts).to_be_visible(timeout=20_000)
        wait_for(lambda: coloured_share(drawn(page)) > 0.01, "the cloud is drawn")
        assert any("cloud.worker" in worker.url for worker in page.workers)
        before = drawn(page)
        canvas = page.get_by_role("img", name="Point cloud cloud")
        canvas.focus()
        for _ in range(10):
            page.keyboard.press("ArrowUp", delay=10)
        page.mouse.wheel(0, -200)
        wait_for(lambda: np.abs(drawn(page) - before).mean() > 1, "the picture turns")
        page.get_by_role("button", name="Fit the view").click()
        page.get_by_text("Distance", exact=True).click()
        wait_for(lambda: coloured_share(drawn(page)) > 0.01, "the cloud is drawn by distance")


def test_without_webgl_it_is_said(
    playwright: Playwright, chromium: str, server: Any, seed: Any, sign_in: Any, cloud_robot: Any
) -> None:
    flags = NO_GRAPHICS
    with browsing(playwright, chromium, flags) as browser, robot_page(browser, server, seed, sign_in) as page:
        expect(page.get_by_text("This browser can't draw point clouds now")).to_be_visible()


@pytest.fixture(scope="module")
def depth_robot(start_robot: Any) -> Any:
    camera = "camera: { source: fake, width: 320, height: 240, fps: 15 }"
    parts = ("depth-camera, label: front", "depth-picture, label: front_depth", "depth-cloud, label: front_cloud")
    return start_robot("".join(f"  - {{ type: {part}, params: {{ {camera} }} }}\n" for part in parts), wait=False)


COLOUR_AT = """([label, x, y]) => {
  const video = document.querySelector(`video[aria-label="Picture of ${label}"]`)
  if (!video?.videoWidth) return [0, 0, 0]
  const canvas = new OffscreenCanvas(video.videoWidth, video.videoHeight)
  canvas.getContext('2d').drawImage(video, 0, 0)
  return [...canvas.getContext('2d').getImageData(x * video.videoWidth, y * video.videoHeight, 1, 1).data.slice(0, 3)]
}"""


def test_a_depth_camera_is_its_picture_its_depth_in_colours_and_a_cloud(
    playwright: Playwright,
    chromium: str,
    server: Any,
    seed: Any,
    sign_in: Any,
    depth_robot: Any,
    wait_for: Callable[..., float],
) -> None:
    flags = SOFTWARE_GRAPHICS
    with browsing(playwright, chromium, flags) as browser, robot_page(browser, server, seed, sign_in) as page:
        wait_for(lambda: page.evaluate(COLOUR_AT, ["front", 0.9, 0.1])[2] > 150, "the wall is seen")

        def is_far(place: tuple[float, float]) -> bool:
            red, _, blue = page.evaluate(COLOUR_AT, ["front_depth", *place])
            return bool(blue > red + 60)

        wait_for(lambda: is_far((0.9, 0.1)), "the wall is far: blue")
        near = page.evaluate(COLOUR_AT, ["front_depth", 0.9, 0.97])
        assert near[0] > near[2], "the floor before the camera is near"
        assert max(page.evaluate(COLOUR_AT, ["front_depth", 0.01, 0.5])) < 60, "what is not known is black"
        expect(page.get_by_text(re.compile(r"1\d,\d{3} points · [\d.]+ Hz"))).to_be_visible(timeout=20_000)
        expect(page.get_by_text(re.compile(r"^119\.5"))).to_be_visible()
        photographed(page, "depth-camera")
