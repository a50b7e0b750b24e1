"""A page in Chromium is a robot, another one its operator: a picture moves, values arrive, and one press ends it."""

from __future__ import annotations

import asyncio
import os
import re
import signal
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from typing import Any

import httpx
import pytest
from playwright.sync_api import Browser, BrowserContext, Page, Playwright, expect
from support.people import access_token, wait_connected
from support.waiting import wait_for

from mosaic_core.messages import BatteryState
from mosaic_core.operator import MosaicOperator

pytestmark = [pytest.mark.e2e, pytest.mark.timeout(180)]

FAKE = ["--use-fake-device-for-media-stream", "--use-fake-ui-for-media-stream"]
"""Chromium's own camera shows a clock; its dialogue says yes."""
PHONE = {"width": 390, "height": 844}
BERLIN = {"latitude": 52.52, "longitude": 13.405, "accuracy": 8.0}
ALLOWED = ["geolocation", "camera", "microphone", "accelerometer", "gyroscope"]
PICTURE_MOVES = """
  () => new Promise((resolve) => {
    const video = document.querySelector('video')
    if (video === null) return resolve(false)
    let seen = 0
    const shown = () => (++seen >= 5 ? resolve(true) : video.requestVideoFrameCallback(shown))
    video.requestVideoFrameCallback(shown)
  })
"""


@pytest.fixture(scope="module")
def quiet_words(quiet_words: list[str]) -> list[str]:
    """Every browser here has a camera."""
    return [*quiet_words, *FAKE]


@pytest.fixture(scope="module")
def with_camera(playwright: Playwright, chromium: str, quiet_words: list[str]) -> Iterator[Browser]:
    running = playwright.chromium.launch(executable_path=chromium, args=quiet_words)
    yield running
    running.close()


@pytest.fixture(scope="module")
def phone(with_camera: Browser) -> Iterator[BrowserContext]:
    """The browser of the phone, over the whole module: it remembers which robot it is."""
    context = phone_in(with_camera)
    yield context
    context.close()


def phone_in(browser: Browser) -> BrowserContext:
    return browser.new_context(viewport=PHONE, geolocation=BERLIN, permissions=ALLOWED)  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def account(server: Any, seed: Any) -> Iterator[httpx.Client]:
    with httpx.Client(base_url=f"{server.url}/api/v1") as api:
        api.headers["Authorization"] = f"Bearer {access_token(server.url, seed.email, seed.password)}"
        yield api


@pytest.fixture
def shared(phone: BrowserContext, server: Any, account: httpx.Client) -> Iterator[Page]:
    """The phone's page after the link was opened and everything but the loudspeaker was switched on and shared."""
    with sharing(phone, server, account) as page:
        yield page


@contextmanager
def sharing(phone: BrowserContext, server: Any, account: httpx.Client, name: str = "") -> Iterator[Page]:
    page = phone.new_page()
    errors: list[str] = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    code = account.post("/account/one-time-code").raise_for_status().json()["resultData"]["code"]
    page.goto(f"{server.url}/share#code={code}")
    for what in ("Position", "Microphone"):
        page.get_by_role("switch", name=what).set_checked(True)
    if name:
        page.get_by_label("Name of the robot").fill(name)
    page.get_by_role("button", name="Start sharing").click()
    expect(standing(page)).to_have_text("Nobody watches: camera and microphone are off.")
    yield page
    page.close()
    assert errors == []


@pytest.fixture
def operator(with_camera: Browser, server: Any, sign_in: Callable[[Page], None]) -> Iterator[Page]:
    context = with_camera.new_context(viewport={"width": 1280, "height": 900})
    page = context.new_page()
    sign_in(page)
    page.goto(server.url)
    yield page
    context.close()


def standing(page: Page) -> Any:
    return page.get_by_test_id("standing")


def robot_id_of(page: Page) -> str:
    found: str = page.evaluate("() => JSON.parse(localStorage.getItem('mosaic.sharedRobot')).robotId")
    return found


def test_a_phone_is_seen_and_heard_of_until_it_stops(shared: Page, operator: Page, seed: Any) -> None:
    operator.get_by_role("link", name="Linux computer").click()
    wait_connected(operator)
    assert operator.evaluate(PICTURE_MOVES)
    expect(operator.get_by_text("52.520000° N · 13.405000° E")).to_be_visible()
    expect(operator.locator("section", has_text="battery").get_by_text("%", exact=True)).to_be_visible()
    operator.get_by_role("button", name="Listen").click()
    expect(standing(shared)).to_have_text("Shared now: camera and microphone.")
    here = shared.get_by_role("region", name="Who is here").get_by_role("listitem")
    expect(here).to_contain_text(f"{seed.email} gets camera, microphone, position, motion, battery, log")
    expect(here).not_to_contain_text("word")  # its ticket was checked
    shared.get_by_role("button", name="Stop sharing").click()
    expect(shared.get_by_role("button", name="Start sharing")).to_be_visible()
    expect(operator.get_by_text("The robot isn't connected to the server.")).to_be_visible()


def test_what_is_shared_and_its_end_are_at_hand_however_far_a_phone_is_scrolled(shared: Page) -> None:
    shared.set_viewport_size({"width": PHONE["height"], "height": PHONE["width"]})
    shared.mouse.wheel(0, 5000)
    expect(shared.get_by_text("Keep this page in front")).to_be_in_viewport()
    expect(standing(shared)).to_be_in_viewport(ratio=1)
    expect(shared.get_by_role("button", name="Stop sharing")).to_be_in_viewport(ratio=1)


def test_the_camera_is_off_while_nobody_watches_and_the_other_one_takes_over(shared: Page, operator: Page) -> None:
    operator.goto(f"{operator.url}robots/{robot_id_of(shared)}")
    wait_connected(operator)
    expect(standing(shared)).to_have_text("Shared now: camera.")
    shared.get_by_text("360p").click()
    operator.wait_for_function("() => document.querySelector('video')?.videoHeight <= 360")
    assert operator.evaluate(PICTURE_MOVES)
    operator.close()
    expect(standing(shared)).to_have_text("Nobody watches: camera and microphone are off.")


def age_ms(page: Page) -> float:
    """How old the picture is that the operator sees, by the facts below it; -1 where nobody knows."""
    found = re.search(r"(\d+) ms old", page.get_by_test_id("picture-facts").inner_text())
    return float(found[1]) if found else -1.0


def test_the_operator_sees_how_old_the_phones_picture_is(shared: Page, operator: Page) -> None:
    operator.goto(f"{operator.url}robots/{robot_id_of(shared)}")
    wait_connected(operator)
    wait_for(lambda: 0 <= age_ms(operator) < 5000, "the age of the picture is shown")


def test_a_browser_that_stood_still_shares_again_by_itself(
    own_browser: Any, operator: Page, server: Any, account: httpx.Client
) -> None:
    """As behind a locked screen: nothing of it runs, and its operator has long lost it."""
    with sharing(phone_in(own_browser.browser), server, account, "A phone that sleeps") as page:
        operator.goto(f"{operator.url}robots/{robot_id_of(page)}")
        wait_connected(operator)
        assert operator.evaluate(PICTURE_MOVES)
        os.killpg(own_browser.process.pid, signal.SIGSTOP)
        try:
            expect(operator.get_by_test_id("video")).to_have_attribute("data-state", "reconnecting")
        finally:
            os.killpg(own_browser.process.pid, signal.SIGCONT)
        expect(operator.get_by_test_id("video")).to_have_attribute("data-state", "live")
        assert operator.evaluate(PICTURE_MOVES)
        expect(standing(page)).to_have_text("Shared now: camera.")
        page.get_by_role("button", name="Stop sharing").click()
        expect(page.get_by_role("button", name="Start sharing")).to_be_visible()


def test_another_network_is_used_at_once(shared: Page, operator: Page, phone: BrowserContext) -> None:
    operator.goto(f"{operator.url}robots/{robot_id_of(shared)}")
    wait_connected(operator)
    phone.set_offline(True)
    expect(standing(shared)).to_have_text("Looking for the server …")
    phone.set_offline(False)
    expect(standing(shared)).to_have_text("Shared now: camera.")
    operator.reload()
    wait_connected(operator)
    assert operator.evaluate(PICTURE_MOVES)


def test_the_same_phone_is_the_same_robot_and_keeps_no_account(
    shared: Page, phone: BrowserContext, server: Any, account: httpx.Client
) -> None:
    robots = account.get("/robots").json()["resultData"]["data"]
    assert [robot["id"] for robot in robots if robot["name"] == "Linux computer"] == [robot_id_of(shared)]
    kept = shared.evaluate("() => [...Object.keys(localStorage), ...Object.keys(sessionStorage)]")
    assert "mosaic.accessToken" not in kept
    list_page = phone.new_page()
    list_page.goto(server.url)
    expect(list_page.get_by_label("Email")).to_be_visible()
    list_page.close()


def test_an_operator_in_python_sees_it_and_reads_its_battery(shared: Page, server: Any, seed: Any) -> None:
    with ThreadPoolExecutor(1) as beside:  # Playwright has the event loop of this thread
        size, percent = beside.submit(asyncio.run, looked(server.url, seed, robot_id_of(shared))).result(timeout=60)
    assert min(size) > 0
    assert 0 <= percent <= 100


async def looked(url: str, seed: Any, robot_id: str) -> tuple[tuple[int, ...], float]:
    async with await MosaicOperator.login(url, seed.email, seed.password) as operator:
        connection = await operator.connect(robot_id)
        image = await connection.media("camera").next_image()
        state = (await connection.receivable("battery").next_message()).message()
        assert isinstance(state, BatteryState)
        assert state.percent is not None
        return image.shape, state.percent


def test_a_new_token_ends_it_and_the_phone_may_become_another_robot(shared: Page, account: httpx.Client) -> None:
    account.post("/robots/auth/simple-token", json={"robotId": robot_id_of(shared)}).raise_for_status()
    expect(shared.get_by_role("alert")).to_contain_text("It was deleted, or got a new token.")
    shared.get_by_role("button", name="Be a new robot").click()
    expect(shared.get_by_label("Name of the robot")).to_be_visible()
