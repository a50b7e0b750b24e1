"""An arm that is made up in a real Chromium: moved by sliders, gripper, poses and by hand; it stands at a stop and when
nobody is there any more."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Iterator
from typing import Any

import pytest
from playwright.sync_api import Browser, Locator, Page, expect
from support.people import photographed, wait_connected
from support.waiting import wait_for

from mosaic_core.messages import JointState
from mosaic_core.operator import MosaicOperator

pytestmark = [pytest.mark.e2e, pytest.mark.timeout(240)]

CONNECTORS = """\
  - { type: arm-joints, label: joints, params: { arm: &arm { bus: fake } } }
  - { type: arm-state, label: joint_state, params: { arm: *arm } }
  - { type: arm-gripper, label: gripper, params: { arm: *arm } }
  - { type: arm-poses, label: poses, params: { arm: *arm, poses: { up: { shoulder_lift: 0.5, elbow_flex: -0.5 } } } }
  - { type: arm-pose-names, label: pose_names, params: { arm: *arm } }
  - { type: arm-freedrive, label: freedrive, params: { arm: *arm } }
  - { type: arm-health, label: arm_health, params: { arm: *arm, period_s: 0.2 } }
  - { type: joystick, label: stick, params: { stick: fake } }
"""
ELBOW = "elbow_flex"
MOST_RADPS = 1.5


@pytest.fixture(scope="module")
def robot(start_robot: Any) -> Any:
    return start_robot(CONNECTORS)


@pytest.fixture
def page(browser: Browser, server: Any, seed: Any, sign_in: Any, robot: Any) -> Iterator[Page]:
    page = browser.new_context(viewport={"width": 1500, "height": 1500}).new_page()
    page.set_default_timeout(30_000)
    sign_in(page)
    page.goto(f"{server.url}/robots/{seed.robot_id}")
    wait_connected(page)
    page.get_by_role("button", name="Take control").first.click()
    expect(page.get_by_role("button", name="You have control").first).to_be_visible()
    yield page
    page.context.close()


def card(page: Page, label: str) -> Locator:
    return page.locator(f"section[data-label={label}]")


def angle_rad(page: Page, joint: str) -> float:
    row = page.get_by_role("region", name="Joints of joint_state").get_by_role("row", name=joint)
    return float(row.get_by_role("cell").first.inner_text().replace("−", "-"))


def move(page: Page, joint: str, to_rad: float) -> None:
    target = page.get_by_role("group", name="Target of joints")
    slider = target.get_by_role("slider", name=joint, exact=True)
    expect(slider).not_to_have_attribute("aria-valuetext", "not set")  # until it is known where the joint stands
    slider.fill(str(to_rad))
    card(page, "joints").get_by_role("button", name="Move").click()


def test_joints_gripper_and_poses_are_moved_on_their_cards(page: Page) -> None:
    move(page, ELBOW, 1.0)
    wait_for(lambda: abs(angle_rad(page, ELBOW) - 1.0) < 0.05, "the elbow is there")
    card(page, "gripper").get_by_role("textbox", name="Opening").fill("0.06")
    before = angle_rad(page, "gripper")
    card(page, "gripper").get_by_role("button", name="Move").click()
    wait_for(lambda: abs(angle_rad(page, "gripper") - before) > 0.5, "the gripper opens")
    assert abs(angle_rad(page, ELBOW) - 1.0) < 0.05
    poses = card(page, "poses")
    poses.get_by_label("Name").fill("up")
    poses.get_by_role("button", name="Ask", exact=True).click()
    expect(poses.get_by_label("Answer")).to_contain_text("Off by")
    assert abs(angle_rad(page, "shoulder_lift") - 0.5) < 0.15
    expect(page.get_by_role("meter", name="rz")).to_be_visible()
    photographed(page, "arm-moved")


def test_the_motors_go_off_only_if_somebody_says_that_they_hold_the_arm(page: Page) -> None:
    freedrive = card(page, "freedrive")
    freedrive.get_by_role("switch", name="Motors off").click()
    freedrive.get_by_role("button", name="Ask", exact=True).click()
    expect(freedrive).to_contain_text("without its motors the arm falls")
    freedrive.get_by_label("Somebody holds the arm").select_option("yes")
    freedrive.get_by_role("button", name="Ask", exact=True).click()
    expect(freedrive.get_by_label("Answer")).to_contain_text("falls unless somebody holds")
    expect(card(page, "arm_health")).to_contain_text("the motors are off")
    photographed(page, "arm-free")
    freedrive.get_by_role("switch", name="Motors off").click()
    freedrive.get_by_role("button", name="Ask", exact=True).click()
    expect(freedrive.get_by_label("Answer")).to_contain_text("hold the arm where it is")


def swinging(page: Page) -> float:
    """The elbow is on its way from one end to the other, and where it goes to."""
    far_rad = -2.5 if angle_rad(page, ELBOW) > 0 else 2.5
    before = angle_rad(page, ELBOW)
    move(page, ELBOW, far_rad)
    wait_for(lambda: abs(angle_rad(page, ELBOW) - before) > 0.2, "it moves")
    return far_rad


async def elbow(server: Any, seed: Any) -> AsyncIterator[float]:
    """As another operator is told."""
    async with await MosaicOperator.login(server.url, seed.email, seed.password) as operator:
        connection = await operator.connect(seed.robot_id, timeout_s=30)
        async for received in connection.receivable("joint_state").messages():
            state = JointState.model_validate_json(received.data)
            yield state.positions[state.names.index(ELBOW)]


def stands_short_of(server: Any, seed: Any, far_rad: float) -> None:
    """It stands for a second, and is not where it was sent."""

    async def seen() -> list[float]:
        angles = elbow(server, seed)
        try:
            return [await anext(angles) for _ in range(30)]
        finally:
            await angles.aclose()  # type: ignore[attr-defined]

    found = asyncio.run(asyncio.wait_for(seen(), 60))[10:]
    assert max(found) - min(found) < 0.02
    assert abs(found[-1] - far_rad) > 0.2


def test_a_stop_holds_the_arm_on_its_way(page: Page, server: Any, seed: Any) -> None:
    far_rad = swinging(page)
    page.get_by_test_id("stop").click()
    expect(page.get_by_role("button", name="Hold to clear")).to_be_visible()
    photographed(page, "arm-stopped")
    in_thread(lambda: stands_short_of(server, seed, far_rad))
    page.get_by_role("button", name="Hold to clear").hover()
    page.mouse.down()
    expect(page.get_by_test_id("stopped-banner")).to_have_count(0)
    page.mouse.up()


def test_an_arm_whose_operator_is_gone_stands_on_its_way(page: Page, server: Any, seed: Any) -> None:
    far_rad = swinging(page)
    page.close()
    in_thread(lambda: stands_short_of(server, seed, far_rad))


def in_thread(work: Any) -> None:
    """On this thread there is the loop of Playwright."""
    from concurrent.futures import ThreadPoolExecutor

    with ThreadPoolExecutor(1) as elsewhere:
        elsewhere.submit(work).result()
