"""Every page and state of the dashboard under axe-core, light and dark, on a screen and on a phone, held either way."""

from __future__ import annotations

import re
import signal
from collections.abc import Callable, Iterator
from typing import Any

import httpx
import pytest
from playwright.sync_api import Locator, Page, Route, expect
from support.accessibility import Examination
from support.people import SIGN_IN, Tabs, access_token, photographed, wait_connected

pytestmark = [pytest.mark.e2e, pytest.mark.timeout(240)]

CONNECTORS = """\
  - { type: sim-camera, label: front, params: { width: 320, height: 240, fps: 5 } }
  - { type: cmd-vel, label: cmd_vel, params: { drive: { type: sim } } }
  - { type: sim-laser-scan, label: scan }
  - { type: sim-pose, label: pose }
  - { type: sim-battery, label: battery }
  - { type: sim-imu, label: imu }
  - { type: sim-gps, label: gps }
  - { type: sim-point-cloud, label: cloud, params: { rate_hz: 1, columns: 64 } }
  - { type: sim-map, label: map }
  - { type: sim-path, label: way_home }
  - { type: sim-marks, label: marks, params: { camera: front, width: 320, height: 240 } }
  - { type: sim-mast, label: mast }
  - { type: sim-mast-target, label: mast_target }
  - { type: sim-health, label: health }
  - { type: host-load, label: host }
  - { type: recorder, label: recorder, params: { directory: FOLDER, labels: [front], data: [pose] } }
  - { type: microphone, label: ears, params: { source: "tone:440" } }
  - { type: speaker, label: voice, params: { output: FOLDER/voice.wav } }
  - { type: connection-check, label: link }
"""
OTHER_VIEWS = (("link", "Send a message"), ("battery", "Time plot"), ("host", "Raw JSON"), ("cloud", "Bytes"))
"""What no connector of this robot is shown as by itself."""
DIALOG = "[role=dialog]"


@pytest.fixture(scope="module")
def robot(start_robot: Any, tmp_path_factory: pytest.TempPathFactory) -> Any:
    return start_robot(CONNECTORS.replace("FOLDER", str(tmp_path_factory.mktemp("recordings"))))


@pytest.fixture(scope="module")
def observer(server: Any, seed: Any, robot: Any) -> str:
    """The access token of somebody who may only watch."""
    with httpx.Client(base_url=f"{server.url}/api/v1") as api:
        api.headers["Authorization"] = f"Bearer {access_token(server.url, seed.email, seed.password)}"
        new = {"email": "axe-watcher@example.org", "fullName": "Wanda Watcher", "password": seed.password}
        account = api.post("/users", json=new).raise_for_status().json()["resultData"]["id"]
        api.put(f"/robots/{seed.robot_id}/grants/{account}", json={"role": "observer"}).raise_for_status()
    return access_token(server.url, new["email"], seed.password)


@pytest.fixture
def page(tabs: Tabs) -> Iterator[Page]:
    with tabs.lent() as page:
        yield page


@pytest.fixture
def examined(page: Page) -> Iterator[Examination]:
    examination = Examination(page)
    yield examination
    examination.expect_nothing()


def test_whoever_is_not_signed_in_yet(page: Page, examined: Examination, server: Any) -> None:
    page.goto(server.url)
    page.get_by_label("Email").fill("nobody@example.org")
    examined.look("sign-in")
    page.locator("input[type=password]").fill("wrong")
    page.keyboard.press("Enter")
    page.get_by_role("alert").wait_for()
    examined.look("sign-in refused")
    patch(page, "server", pairsWith="Rover")
    page.goto(server.url)
    page.get_by_role("heading", name="Pair with Rover").wait_for()
    examined.look("pairing")
    page.route("**/api/v1/account/**", lambda _: None)  # never answered
    page.goto(server.plain_url)
    page.goto(f"{server.url}/#code=of-anybody")
    page.get_by_label("Signing in").wait_for()
    examined.look("signing in")


def test_a_code_in_the_address_asks_who_is_signed_in(
    page: Page, examined: Examination, server: Any, sign_in: Any
) -> None:
    sign_in(page)
    page.goto(f"{server.url}/#code=of-somebody-else")
    page.get_by_role("heading", name="Sign in with the link?").wait_for()
    examined.look("a code while somebody is signed in")
    page.get_by_role("button", name="Sign in with the link").click()
    expect(page.get_by_role("alert")).to_be_visible()
    page.get_by_role("button", name="Stay signed in").click()
    page.get_by_role("heading", name="Robots").wait_for()


def test_the_list_of_robots(page: Page, examined: Examination, server: Any, robot: Any, sign_in: Any) -> None:
    sign_in(page)
    page.goto(server.url)
    page.get_by_role("heading", name="Robots").wait_for()
    page.get_by_text("Test robot").wait_for()
    examined.look("robots")
    page.get_by_role("button", name="Add robot").click()
    page.get_by_label("Name").fill("kitchen-bot")
    examined.look("adding a robot")
    page.get_by_role("dialog").get_by_role("button", name="Add robot").click()
    page.get_by_role("button", name="Done").wait_for()
    examined.look("token of a new robot")
    page.get_by_role("button", name="Done").click()
    page.get_by_text("kitchen-bot").click()
    page.get_by_text("Offline", exact=True).wait_for()
    examined.look("robot that is offline")
    patch(page, "robots", data=[], count=0)
    page.goto(server.url)
    page.get_by_role("heading", name="No robots yet").wait_for()
    examined.look("no robots")


def test_a_phone_is_shared(page: Page, examined: Examination, server: Any, sign_in: Any) -> None:
    page.context.grant_permissions(["accelerometer", "gyroscope"])
    sign_in(page)
    page.goto(server.url)
    page.get_by_role("button", name="Use a phone").click()
    page.get_by_role("link", name="Use this device instead").wait_for()
    examined.look("use a phone", DIALOG)
    page.goto(f"{server.url}/share")
    page.get_by_role("heading", name="Use this device as a robot").wait_for()
    examined.look("what is shared")
    page.get_by_role("switch", name="Camera").set_checked(False)
    page.get_by_role("button", name="Start sharing").click()
    page.get_by_text("Nobody watches").wait_for()
    examined.look("sharing")
    page.get_by_role("button", name="Stop sharing").click()
    page.get_by_role("button", name="Be a new one").wait_for()
    examined.look("a robot of before")


def test_the_server_is_not_there(page: Page, examined: Examination, server: Any, seed: Any, sign_in: Any) -> None:
    sign_in(page)
    page.route("**/api/v1/robots**", lambda route: route.abort())
    page.route_web_socket("**/ws/**", lambda socket: socket.close())
    page.goto(server.url)
    page.get_by_role("button", name="Try again").wait_for()
    page.get_by_text("No connection to the server").wait_for()
    page.get_by_role("link", name="Check connection").click(trial=True)  # nothing lies over it
    examined.look("robots without the server")
    page.goto(f"{server.url}/robots/{seed.robot_id}")
    page.get_by_text("No connection to the server").wait_for()
    examined.look("robot without the server")
    page.close()  # as nothing else ends what is done to its sockets


def test_the_connection_is_checked(page: Page, examined: Examination, server: Any, sign_in: Any) -> None:
    sign_in(page)
    page.goto(f"{server.url}/check")
    page.get_by_test_id("check").wait_for()
    examined.look("check under way")
    page.get_by_role("button", name="Check again").and_(page.locator(":not([data-loading])")).wait_for()
    examined.look("check")


def test_who_may_only_watch(
    page: Page, examined: Examination, server: Any, seed: Any, observer: str, tabs: Tabs, sign_in: Any
) -> None:
    page.goto(server.plain_url)
    page.evaluate(SIGN_IN, observer)
    open_robot(page, server, seed)
    examined.look("observer")
    with tabs.lent() as supervisor:
        sign_in(supervisor)
        open_robot(supervisor, server, seed)
        supervisor.get_by_test_id("presence").click()
        supervisor.get_by_role("button", name="Take the right to stop").click()
        page.get_by_text("You may no longer stop this robot.").wait_for()
        expect(page.get_by_test_id("stop")).to_be_disabled()
        examined.look("observer without the right to stop")
        supervisor.get_by_role("button", name="Let stop again").click()
        page.get_by_text("You may stop this robot again.").wait_for()
        expect(page.get_by_test_id("stop")).to_be_enabled()


def test_the_page_of_a_robot(
    page: Page, examined: Examination, server: Any, seed: Any, robot: Any, sign_in: Any
) -> None:
    sign_in(page)
    open_robot(page, server, seed)
    examined.look("robot")
    for label, view in OTHER_VIEWS:
        menu_of(page, label)
        page.get_by_role("menuitem", name=view, exact=True).click()
        card(page, label).and_(page.get_by_role("region", name=f"{label}: {view}")).wait_for()
    examined.look("robot with other views")
    menu_of(page, "front")
    examined.look("menu of a card", "[role=menu]")
    page.get_by_role("menuitem", name="Delivery").click()
    page.get_by_role("dialog", name="Delivery of front").wait_for()
    examined.look("delivery", DIALOG)
    page.keyboard.press("Escape")
    page.get_by_role("button", name="More for front").click()
    examined.look("menu of a picture", "[role=menu]")
    page.get_by_role("button", name="More for front").click()  # Escape once more, so soon, would stop the robot
    page.get_by_test_id("presence").click()
    examined.look("who is here", DIALOG)
    page.get_by_test_id("presence").click()
    page.locator(DIALOG).wait_for(state="detached")
    page.get_by_test_id("lease-motion").click()
    page.get_by_text("Ready", exact=True).wait_for()
    examined.look("in control")
    page.get_by_test_id("stop").click()
    page.get_by_test_id("stopped-banner").wait_for()
    examined.look("stopped")
    robot.process.send_signal(signal.SIGSTOP)
    try:
        page.locator("[data-away]").first.wait_for(state="attached")
        examined.look("the robot is away")
        photographed(page, "robot-away")
    finally:
        robot.process.send_signal(signal.SIGCONT)


def test_the_dialogs_of_a_robot(
    page: Page, examined: Examination, server: Any, seed: Any, robot: Any, sign_in: Any
) -> None:
    sign_in(page)
    open_robot(page, server, seed)
    for state, open_it in DIALOGS.items():
        open_it(page)
        page.locator(DIALOG).wait_for()
        examined.look(state, DIALOG)
        page.keyboard.press("Escape")
        page.locator(DIALOG).wait_for(state="detached")


def patch(page: Page, path: str, **changes: Any) -> None:
    """The server's answers below `path`, with changes."""

    def answer(route: Route) -> None:
        whole = route.fetch().json()
        route.fulfill(json={**whole, "resultData": {**whole["resultData"], **changes}})

    page.route(re.compile(f"/api/v1/{path}([?]|$)"), answer)


def open_robot(page: Page, server: Any, seed: Any) -> None:
    page.goto(f"{server.url}/robots/{seed.robot_id}")
    wait_connected(page)
    expect(page.locator("[data-label]")).to_have_count(CONNECTORS.count("label:"))
    page.wait_for_function("() => (document.querySelector('video')?.videoWidth ?? 0) > 0")


def card(page: Page, label: str) -> Locator:
    return page.locator(f"[data-label={label}]")


def menu_of(page: Page, label: str) -> None:
    expect(page.get_by_role("menu")).to_have_count(0)  # the one before fades away
    page.get_by_role("button", name=f"Menu of {label}").click()
    page.get_by_role("menuitem", name="Delivery").wait_for()


def of_robot(page: Page, item: str) -> None:
    page.get_by_role("button", name="More about this robot").click()
    page.get_by_role("menuitem", name=item).click()


DIALOGS: dict[str, Callable[[Page], None]] = {
    "connection details": lambda page: page.get_by_role("button", name="Connection details").click(),
    "journal": lambda page: of_robot(page, "Journal"),
    "roles": lambda page: of_robot(page, "Roles"),
    "new token": lambda page: of_robot(page, "New token"),
    "gamepad": lambda page: page.get_by_role("button", name="Set up a gamepad").click(),
    "recordings": lambda page: page.get_by_role("button", name="Files").click(),
}
