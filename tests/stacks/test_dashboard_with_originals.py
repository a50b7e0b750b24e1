"""Original robots on our dashboard, in a real Chromium: described from the robot's own file or by `connectorConfig`."""

from __future__ import annotations

import asyncio
import json
import re
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import pytest
from playwright.sync_api import Page, expect
from support.people import Driver, Tabs, photographed

pytestmark = [pytest.mark.e2e, pytest.mark.timeout(120)]

OURS = "our dashboard"
ROBOT_FILE = """\
connectors:
  - { type: opencv-sender-camera, label: front, params: { fps: 20 } }
  - { type: ros2-sender-geometry-Pose, label: pose, params: { topic_name: /pose } }
  - { type: ros2-receiver-geometry-Twist, label: cmd_vel, params: { topic_name: /cmd_vel } }
  - { type: connection-check, label: link }
  - { type: ros2-sender-sensor-PointCloud2, label: cloud, params: { topic_name: /points, parallel_num: 1 } }
"""
CONNECTOR_CONFIG = {
    "connectors": [
        {"connectorId": "front", "connectorType": "MediaStreamStore", "params": {}},
        {"connectorId": "pose", "connectorType": "JsonReceivableStore", "params": {}},
        {"connectorId": "cmd_vel", "connectorType": "ThumbstickToTwistStore", "params": {}},
        {"connectorId": "link-receiver", "connectorType": "ConnectionCheckSenderStore", "params": {}},
        {"connectorId": "link-sender", "connectorType": "ConnectionCheckReceiverStore", "params": {}},
    ]
}


@pytest.fixture
def person(tabs: Tabs, server: Any, seed: Any) -> Iterator[Page]:
    """Signed in, looking at the list of robots."""
    with tabs.lent() as page:
        Driver(page, server.url, seed).sign_in()
        yield page


@contextmanager
def alive(robot: Any) -> Iterator[Any]:
    """A peer of asyncio on a loop and thread of its own while the browser is looked at."""
    loop = asyncio.new_event_loop()
    thread = threading.Thread(target=loop.run_forever, daemon=True)
    thread.start()
    try:
        asyncio.run_coroutine_threadsafe(robot.__aenter__(), loop).result(20)
        yield robot
        asyncio.run_coroutine_threadsafe(robot.__aexit__(None, None, None), loop).result(20)
    finally:
        loop.call_soon_threadsafe(loop.stop)
        thread.join(10)
        loop.close()


@pytest.fixture
def described(server: Any, seed: Any, rest_of: Any) -> Callable[[str], None]:
    """`described(robot_id)`: the robot's `connectorConfig` as the original page stores it."""

    async def put(rest: Any, robot_id: str) -> None:
        robot = await rest.robot(robot_id)
        body = {key: robot[key] for key in ("name", "description", "authType")}
        await rest("PUT", f"/api/v1/robots/{robot_id}", **body, connectorConfig=json.dumps(CONNECTOR_CONFIG))

    return lambda robot_id: rest_of(lambda rest: put(rest, robot_id))


def card(page: Page, label: str) -> Any:
    return page.locator(f"section[data-label='{label}']")


def sees_data(page: Page) -> None:
    """The pose has arrived on its card, and the connection check shows milliseconds."""
    expect(card(page, "pose")).to_contain_text("received now")
    expect(card(page, "link")).to_contain_text(re.compile(r"most [\d.]+ ms"))


def sees_the_picture_move(page: Page) -> None:
    page.wait_for_function("() => (document.querySelector('video')?.videoWidth ?? 0) > 0")
    start = page.evaluate("() => document.querySelector('video').currentTime")
    page.wait_for_function("start => document.querySelector('video').currentTime > start + 0.3", arg=start)


def drives(page: Page, twists: Callable[[], list[Any]], wait_for: Callable[..., float]) -> None:
    """Held, the key sends speed; released, zeros; and the stop says what it did."""
    expect(page.get_by_test_id("drive-status")).to_have_text("Ready")
    page.keyboard.down("w")
    wait_for(lambda: any(linear > 0 for linear, _ in twists()), "the robot is told to go", 10)
    page.keyboard.up("w")
    wait_for(lambda: tuple(twists()[-1]) == (0, 0), "the robot is told to stand", 10)
    count = len(twists())
    page.get_by_test_id("stop").click()
    wait_for(lambda: len(twists()) > count and tuple(twists()[-1]) == (0, 0), "the stop sends zeros", 10)


def test_an_original_robot_is_described_from_its_file_and_then_as_good_as_ours(
    pair: Any, person: Page, server: Any, c2_robot: Any, wait_for: Any
) -> None:
    pair(OURS, "original robot (C2) on aiortc", "described from its YAML file; picture, data, cloud, driving, stop")
    with alive(c2_robot(cameras=("front",))) as robot:
        person.goto(f"{server.url}/robots/{robot.robot_id}")
        person.get_by_label("The robot’s YAML file").fill(ROBOT_FILE)
        photographed(person, "describe")
        person.get_by_role("button", name="Add 5 connectors").click()
        sees_the_picture_move(person)
        sees_data(person)
        expect(card(person, "cloud")).to_contain_text(re.compile(r"2[\s.,]?500"))
        drives(person, lambda: robot.twists, wait_for)
        photographed(person, "original-robot")
        card(person, "cloud").scroll_into_view_if_needed()
        photographed(person, "original-cloud")
        person.goto(f"{server.url}/robots/{robot.robot_id}")  # kept: the second visit asks nothing
        sees_the_picture_move(person)
        sees_data(person)


def test_an_original_robot_in_chromium_shows_from_its_connector_config(
    pair: Any,
    person: Page,
    server: Any,
    new_robot: Any,
    described: Any,
    browser: Any,
    chromium_host: Any,
    wait_for: Any,
) -> None:
    pair(
        OURS, "original robot in Chromium", "known by its stored `connectorConfig`; picture, data, driving, stop, check"
    )
    robot_id, token = new_robot("raw Chromium")
    described(robot_id)
    context = browser.new_context(permissions=["local-network-access"])
    robot = chromium_host(context.new_page(), server.url).make("Robot", server.url)
    robot("start", robot_id, token, {"cameras": ["front"]})
    person.goto(f"{server.url}/robots/{robot_id}")
    sees_the_picture_move(person)
    sees_data(person)
    drives(person, lambda: robot("look")["twists"], wait_for)
    robot("close")
    context.close()


def test_an_original_robot_on_libdatachannel_shows_from_its_connector_config(
    pair: Any, person: Page, server: Any, new_robot: Any, described: Any, libdatachannel: Any, wait_for: Any
) -> None:
    pair(OURS, "original robot on libdatachannel", "known by its stored `connectorConfig`; data, driving, stop, check")
    robot_id, token = new_robot("libdatachannel")
    described(robot_id)
    robot = libdatachannel.make("Robot", server.url)
    robot("start", robot_id, token)
    person.goto(f"{server.url}/robots/{robot_id}")
    sees_data(person)
    drives(person, lambda: robot("look")["twists"], wait_for)
    robot("close")
