"""A camera that the server had not heard of when the page connected: Chromium shows it on the live connection."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from playwright.sync_api import Browser, Page, Route, WebSocketRoute
from support.people import wait_connected

pytestmark = [pytest.mark.e2e, pytest.mark.timeout(180)]

CONNECTORS = """\
  - { type: sim-camera, label: front, params: { fps: 15 } }
  - { type: test-pattern, label: gripper, params: { width: 320, height: 240, fps: 10 } }
  - { type: sim-battery, label: battery }
"""
NEW_CAMERA = "gripper"


@pytest.fixture(scope="module")
def robot(start_robot: Any) -> Any:
    return start_robot(CONNECTORS, wait=False)


def without_camera(catalogue: dict[str, Any]) -> dict[str, Any]:
    """As the server knew it before the camera was added."""
    kept = [entry for entry in catalogue["entries"] if entry["label"] != NEW_CAMERA]
    return {**catalogue, "hash": "older", "entries": kept}


def answer_with_older_catalogue(route: Route) -> None:
    response = route.fetch()
    body = response.json()
    body["resultData"] = without_camera(body["resultData"])
    route.fulfill(response=response, json=body)


def tell_older_catalogue(page_end: WebSocketRoute) -> None:
    server_end = page_end.connect_to_server()

    def from_server(text: str | bytes) -> None:
        message = json.loads(text)
        data = message.get("data")
        if isinstance(data, dict) and isinstance(data.get("catalogue"), dict):
            data["catalogue"] = without_camera(data["catalogue"])
        page_end.send(json.dumps(message))

    server_end.on_message(from_server)


@pytest.fixture
def page(browser: Browser, robot: Any, sign_in: Callable[[Page], None]) -> Iterator[Page]:
    context = browser.new_context(viewport={"width": 1280, "height": 900})
    page = context.new_page()
    page.set_default_timeout(20_000)
    page.route("**/catalogue", answer_with_older_catalogue)
    page.route_web_socket("**/ws/user*", tell_older_catalogue)
    sign_in(page)
    yield page
    context.close()


def test_a_camera_that_came_later_is_watched_while_the_first_one_goes_on(page: Page, server: Any, seed: Any) -> None:
    page.add_init_script(
        """const made = (window.offers = [])
        const described = RTCPeerConnection.prototype.setLocalDescription
        RTCPeerConnection.prototype.setLocalDescription = function (description) {
          made.push((description?.sdp?.match(/^m=video/gm) ?? []).length)
          return described.call(this, description)
        }"""
    )
    page.goto(f"{server.url}/robots/{seed.robot_id}")
    wait_connected(page)
    for label in ("front", NEW_CAMERA):
        plays = f"""() => (document.querySelector('video[aria-label="Picture of {label}"]')?.videoWidth ?? 0) > 0"""
        page.wait_for_function(plays)
    assert page.evaluate("() => window.offers") == [1, 2]
    shown = """(label) => document.querySelector(`video[aria-label="Picture of ${label}"]`).currentTime"""
    before_s = page.evaluate(shown, "front")
    page.wait_for_function(f"""() => ({shown})('front') > {before_s} + 0.5""")
