"""A person in Chromium sees and drives the simulated robot; whatever happens to the page, the robot stops."""

from __future__ import annotations

import os
import signal
import time
from typing import Any

import pytest
from support.waiting import wait_for

pytestmark = [pytest.mark.e2e, pytest.mark.timeout(180)]

LATE_S = 1.6
"""Seeing it takes this long: the robot's braking, and two looks of ours."""


def mean_difference(a: list[int], b: list[int]) -> float:
    return sum(abs(x - y) for x, y in zip(a, b, strict=True)) / len(a)


def lost(robot: Any) -> int:
    """How many operators the robot has lost so far."""
    return sum("left (peer.lost)" in line for line in robot.log)


def drive_off(driver: Any, observer: Any) -> None:
    driver.take_control()
    driver.drive_off(observer)


def test_the_picture_moves_when_the_robot_turns(driver: Any, observer: Any) -> None:
    before = driver.picture()
    start_yaw_rad = observer.now[3]
    driver.take_control()
    driver.page.keyboard.down("a")
    wait_for(lambda: abs(observer.now[3] - start_yaw_rad) > 0.5, "the robot turns")
    driver.page.keyboard.up("a")
    wait_for(observer.rests, "the robot rests")
    wait_for(lambda: mean_difference(before, driver.picture()) > 8, "the picture shows another view")


def test_holding_a_key_drives_and_releasing_it_stops(driver: Any, observer: Any) -> None:
    drive_off(driver, observer)
    driver.page.keyboard.up("w")
    driver.page.keyboard.up("a")
    observer.expect_rest(time.monotonic())


def test_the_stick_drives_and_letting_go_stops(driver: Any, observer: Any) -> None:
    pad = driver.page.get_by_role("application", name="Drive pad").bounding_box()
    x, y = pad["x"] + pad["width"] / 2, pad["y"] + pad["height"] / 2
    driver.take_control()
    start_s = time.monotonic()
    driver.page.mouse.move(x, y)
    driver.page.mouse.down()
    driver.page.mouse.move(x - pad["width"] / 4, y - pad["height"] / 4, steps=4)
    wait_for(lambda: observer.way_m(start_s) > 0.05, "the robot moves while the stick is held")
    driver.page.mouse.up()
    observer.expect_rest(time.monotonic())


def test_a_page_that_loses_focus_stops_the_robot(driver: Any, observer: Any) -> None:
    drive_off(driver, observer)
    driver.page.evaluate("window.dispatchEvent(new Event('blur'))")
    observer.expect_rest(time.monotonic())


def test_closing_the_tab_while_driving_stops_the_robot(driver: Any, observer: Any) -> None:
    drive_off(driver, observer)
    driver.page.close()
    observer.expect_rest(time.monotonic())


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP], ids=["killed", "frozen"])
def test_a_browser_that_dies_while_driving_stops_the_robot_and_is_noticed(
    own_browser: Any,
    driver_of: Any,
    robot: Any,
    observer: Any,
    number: signal.Signals,
) -> None:
    wait_for(observer.rests, "the robot rests before the test")
    driver = driver_of(own_browser.browser.contexts[0].pages[0])
    drive_off(driver, observer)
    before = lost(robot)
    os.killpg(own_browser.process.pid, number)
    died_s = time.monotonic()
    observer.expect_rest(died_s)
    wait_for(lambda: lost(robot) > before, "the robot notices the lost operator")
    noticed_s = time.monotonic() - died_s - observer.kept_waiting_s(died_s)
    assert noticed_s < 2.0 + LATE_S, "2 s of silence"


def test_two_people_see_the_same_robot(driver: Any, seated: Any) -> None:
    with seated() as other:
        assert mean_difference(driver.picture(), other.picture()) < 12
