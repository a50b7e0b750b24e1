"""A person in Chromium at an original robot: it announces nothing, is described once, then driven like any other."""

from __future__ import annotations

import json
import math
import re
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest
from playwright.sync_api import Locator, Page, expect
from support.accessibility import Examination
from support.people import Tabs, photographed, wait_connected

sys.path.insert(0, str(Path(__file__).parent))
from original_robot import READY, OriginalRobot

pytestmark = [pytest.mark.e2e, pytest.mark.timeout(180)]

YAML = """\
server:
  ws_url: wss://mosaic.example.org
  auth: { type: simple-token, robot_id: 7d1c2f6e, params: { token: a-secret-word } }
  webrtc: { ice_servers: [] }
connectors:
  - { type: opencv-sender-camera, label: front, params: { fps: 15 } }
  - { type: ros2-receiver-geometry-Twist, label: cmd_vel, params: { topic_name: /cmd_vel } }
  - { type: turtlebot-sender-laser-scan, label: scan }
  - { type: connection-check, label: L }
  - { type: acme-sender-engine, label: engine }
"""
ZERO = {"linear": {"x": 0, "y": 0, "z": 0}, "angular": {"x": 0, "y": 0, "z": 0}}


def scan() -> str:
    ranges = [1 + 0.5 * math.sin(index / 10) for index in range(90)]
    head = {"angle_min": 0, "angle_max": 6.28, "angle_increment": 0.07, "range_min": 0.12, "range_max": 3.5}
    return json.dumps({**head, "ranges": ranges, "intensities": []}, indent="\t")


@pytest.fixture
def original(server: Any, seed: Any) -> Iterator[OriginalRobot]:
    robot = OriginalRobot(
        server.url,
        seed.robot_id,
        seed.robot_token,
        cameras=("front",),
        senders={"scan": scan, "engine": lambda: json.dumps({"rpm": 1200, "temperature_c": 71.5})},
        receivers=("cmd_vel",),
    )
    robot.start()
    yield robot
    robot.stop()


@pytest.fixture
def page(tabs: Tabs, original: OriginalRobot, sign_in: Callable[[Page], None]) -> Iterator[Page]:
    with tabs.lent() as page:
        sign_in(page)
        yield page


def card(page: Page, label: str) -> Locator:
    return page.locator(f"[data-label={label}]")


def open_robot(page: Page, server: Any, seed: Any) -> None:
    page.goto(f"{server.url}/robots/{seed.robot_id}")
    wait_connected(page)


def test_an_original_robot_is_described_by_its_yaml_file_and_then_driven_and_watched(
    page: Page, original: OriginalRobot, server: Any, seed: Any, wait_for: Callable[..., float]
) -> None:
    open_robot(page, server, seed)
    page.get_by_role("heading", name="This robot does not say what it has").wait_for()
    photographed(page, "not-described")
    stop = page.get_by_role("button", name="Stop the robot")
    expect(stop).to_contain_text("No stop")
    stop.click()
    expect(page.get_by_test_id("stopped-banner")).to_contain_text("nothing was sent")
    assert original.heard == []

    examined = Examination(page)
    examined.look("not described yet")
    page.get_by_label("The robot’s YAML file").fill(YAML)
    expect(page.get_by_role("list", name="Connectors in the file").get_by_role("listitem")).to_have_count(5)
    photographed(page, "yaml-read")
    examined.look("described by a file")
    page.get_by_role("button", name="Add 5 connectors").click()
    page.get_by_role("application", name="Drive pad").wait_for()
    see_all(page)
    photographed(page, "described")
    examined.look("described")
    examined.expect_nothing()

    page.reload()
    wait_connected(page)
    see_all(page)
    drive(page, original, wait_for)

    seen = len(original.commands("cmd_vel"))
    page.get_by_role("button", name="Stop the robot").click()
    expect(page.get_by_test_id("stopped-banner")).to_contain_text("zeros were sent to ‘cmd_vel’")
    wait_for(lambda: len(original.commands("cmd_vel")) > seen, "zeros arrive")
    assert set(map(json.dumps, original.commands("cmd_vel")[seen:])) == {json.dumps(ZERO)}
    photographed(page, "stopped")
    stored = page.evaluate("() => Object.values(localStorage).join()")
    assert "a-secret-word" not in stored


def see_all(page: Page) -> None:
    """Picture, values and the echo are really there."""
    page.wait_for_function("() => (document.querySelector('video')?.videoWidth ?? 0) > 0")
    expect(card(page, "engine")).to_contain_text("71.5")
    expect(card(page, "L").get_by_test_id("round-trip-now")).to_have_text(re.compile(r"[0-9]"))
    expect(card(page, "scan")).to_have_attribute("aria-label", "scan: Laser scan")


def drive(page: Page, original: OriginalRobot, wait_for: Callable[..., float]) -> None:
    page.keyboard.down("w")
    wait_for(lambda: len(original.commands("cmd_vel")) > 3, "commands arrive")
    assert original.commands("cmd_vel")[0]["linear"]["x"] > 0
    page.keyboard.up("w")
    wait_for(lambda: original.commands("cmd_vel")[-1] == ZERO, "a zero ends the drive")
    # For a second the zero is repeated; then the pad is silent.
    wait_for(lambda: original.commands("cmd_vel")[-19:] == [ZERO] * 19, "the zeros are repeated")


LEAVINGS: dict[str, Callable[[Page], Any]] = {
    "the link back": lambda page: page.get_by_role("link", name="Back to all robots").click(),
    "a reload": lambda page: page.reload(),
    "another page": lambda page: page.goto("about:blank"),
    "a closed tab": lambda page: page.close(),
}


@pytest.mark.parametrize("leave", LEAVINGS.values(), ids=LEAVINGS.keys())
def test_a_page_that_is_left_while_it_drives_leaves_the_robot_standing(
    page: Page,
    original: OriginalRobot,
    server: Any,
    seed: Any,
    wait_for: Callable[..., float],
    leave: Callable[[Page], Any],
) -> None:
    describe(server, seed, {"connectorId": "cmd_vel", "connectorType": "ros2-receiver-geometry-Twist", "params": {}})
    open_robot(page, server, seed)
    page.get_by_role("application", name="Drive pad").wait_for()
    wait_for(lambda: "cmd_vel" in original._open, "the drive's channel is open")
    page.keyboard.down("w")
    wait_for(lambda: len(original.commands("cmd_vel")) > 5, "commands arrive")
    leave(page)
    wait_for(lambda: original.commands("cmd_vel")[-1] == ZERO, "the last command is zero")
    wait_for(lambda: original.state == READY, "the robot is free for the next page")
    assert original.commands("cmd_vel")[-1] == ZERO


def describe(server: Any, seed: Any, *connectors: dict[str, Any]) -> None:
    put_description(server, seed, json.dumps({"connectors": connectors}))


def forget_description(server: Any, seed: Any) -> None:
    put_description(server, seed, None)


def put_description(server: Any, seed: Any, config: str | None) -> None:
    with httpx.Client(base_url=server.url) as http:
        account = {"username": seed.email, "password": seed.password}
        answer = http.post("/api/v1/account/login/access-token", json=account).json()
        http.headers["Authorization"] = f"Bearer {answer['resultData']['accessToken']}"
        path = f"/api/v1/robots/{seed.robot_id}/connector-config"
        assert http.put(path, json={"connectorConfig": config}).is_success


def test_a_label_that_nobody_knows_is_tried_and_found_out(page: Page, server: Any, seed: Any) -> None:
    forget_description(server, seed)
    open_robot(page, server, seed)
    page.get_by_role("heading", name="This robot does not say what it has").wait_for()
    expect(page.get_by_role("list", name="Found connectors")).to_contain_text("front")
    form = page.get_by_role("form", name="Describe a connector by hand")
    form.get_by_label("Label").fill("engine")
    form.get_by_role("button", name="Try this label").click()
    expect(form.get_by_role("status")).to_contain_text("JSON from the robot")
    expect(form.get_by_role("status")).to_contain_text("71.5")
    photographed(page, "tried")
    form.get_by_role("button", name="Add", exact=True).click()
    expect(card(page, "engine")).to_contain_text("71.5")
    page.get_by_role("button", name="Change what it has").click()
    page.get_by_role("button", name="Add front").click()
    page.keyboard.press("Escape")
    page.wait_for_function("() => (document.querySelector('video')?.videoWidth ?? 0) > 0")
