"""Anybody stops the robot: a watching page, the keyboard, Python, the command line. It stands until that is cleared."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import Any

import httpx
import pytest
from playwright.sync_api import expect
from support.people import Driver
from support.processes import run_mosaic

from mosaic_core.operator import MosaicOperator

pytestmark = [pytest.mark.e2e, pytest.mark.timeout(180)]


def clear(person: Any) -> None:
    """Hold the button as long as it wants to be held."""
    banner = person.page.get_by_test_id("stopped-banner")
    banner.get_by_role("button", name="Hold to clear").hover()
    person.page.mouse.down()
    expect(banner).to_have_count(0)
    person.page.mouse.up()


def observer_account(server: Any, seed: Any) -> Any:
    """A new account that may only watch the robot."""
    login = {"username": seed.email, "password": seed.password}
    with httpx.Client(base_url=f"{server.url}/api/v1") as http:
        token = http.post("/account/login/access-token", json=login).raise_for_status().json()["resultData"]
        http.headers["Authorization"] = f"Bearer {token['accessToken']}"
        made = http.post("/users", json={"email": "watcher@example.org", "fullName": "Watcher"}).raise_for_status()
        account = made.json()["resultData"]
        path = f"/robots/{seed.robot_id}/grants/{account['id']}"
        http.put(path, json={"role": "observer"}).raise_for_status()
    return replace(seed, email="watcher@example.org", password=account["password"])


def by_python(server: Any, seed: Any) -> None:
    async def body() -> None:
        async with await MosaicOperator.login(server.url, seed.email, seed.password) as operator:
            connection = await operator.connect(seed.robot_id)
            report = await connection.control.stop("by a program")
            assert report.is_safe

    with ThreadPoolExecutor(1) as elsewhere:  # Playwright has a loop on this thread
        elsewhere.submit(lambda: asyncio.run(body())).result()


def by_command_line(server: Any, seed: Any) -> None:
    run_mosaic(
        "operator", "stop", seed.robot_id, "--server", server.url, "--email", seed.email, "--reason", "by hand",
        MOSAIC_PASSWORD=seed.password,
    )  # fmt: skip


def test_who_only_watches_stops_the_robot_and_it_stands_until_cleared(ann: Any, bob: Any, observer: Any) -> None:
    ann.drive_off(observer)
    bob.page.get_by_test_id("stop").click()
    observer.expect_rest(time.monotonic())
    expect(ann.page.get_by_test_id("stopped-banner")).to_be_visible()
    assert observer.stays()
    clear(ann)
    assert observer.stays()
    ann.release_keys()
    ann.drive_off(observer)


def test_an_observer_gets_no_control_but_stops_the_robot(
    ann: Any, tabs: Any, server: Any, seed: Any, observer: Any
) -> None:
    with tabs.lent() as page:
        _watches_and_stops(Driver(page, server.url, observer_account(server, seed)), ann, observer)


def _watches_and_stops(watcher: Driver, ann: Any, observer: Any) -> None:
    watcher.sign_in()
    watcher.open_robot()
    expect(watcher.lease).to_have_attribute("aria-disabled", "true")
    ann.drive_off(observer)
    watcher.page.get_by_test_id("stop").click()
    observer.expect_rest(time.monotonic())
    banner = watcher.page.get_by_test_id("stopped-banner")
    expect(banner).to_be_visible()
    expect(banner.get_by_role("button", name="Hold to clear")).to_have_count(0)


def test_escape_twice_stops_wherever_the_focus_is(ann: Any, observer: Any) -> None:
    ann.drive_off(observer)
    ann.page.keyboard.press("Escape")
    ann.page.keyboard.press("Escape")
    observer.expect_rest(time.monotonic())
    expect(ann.page.get_by_test_id("stopped-banner")).to_be_visible()


@pytest.mark.parametrize("stop", [by_python, by_command_line])
def test_a_program_and_the_command_line_stop_who_drives_in_the_browser(
    stop: Callable[[Any, Any], None],
    ann: Any,
    server: Any,
    seed: Any,
    observer: Any,
) -> None:
    ann.drive_off(observer)
    stop(server, seed)
    observer.expect_rest(time.monotonic())
    assert observer.stays()
    ann.release_keys()
    observer.clear_stop()
    ann.drive_off(observer)
