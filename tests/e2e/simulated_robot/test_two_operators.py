"""Two people in Chromium at one robot: one drives, the other one asks, takes over, or waits for somebody who froze."""

from __future__ import annotations

import os
import re
import signal
import time
from typing import Any

import pytest
from playwright.sync_api import expect
from support.waiting import wait_for

pytestmark = [pytest.mark.e2e, pytest.mark.timeout(180)]

LEASE_EXPIRY_S = 2.0
SEEN_WITHIN_S = 1.3
"""By somebody else, on a page."""


def ask(person: Any, button: str) -> None:
    """Open the form of the lease's button, and press one of its buttons. To whose page does not know yet that somebody
    else has control, the same button offers to take it, without a form."""
    expect(person.lease).to_have_attribute("data-state", "other")
    person.lease.click()
    form = person.page.get_by_role("form", name="Ask for control")
    form.get_by_label("Reason").fill("my turn")
    form.get_by_role("button", name=re.compile(button)).click()


def expect_keys_do_nothing(person: Any, observer: Any) -> None:
    wait_for(observer.rests, "the robot rests")
    person.hold_keys()
    assert observer.stays()
    person.release_keys()


def test_one_drives_and_the_keys_of_the_other_do_nothing(ann: Any, bob: Any, observer: Any) -> None:
    expect(bob.lease).to_have_attribute("data-state", "other")
    expect_keys_do_nothing(bob, observer)
    ann.drive_off(observer)
    bob.hold_keys()
    ann.release_keys()
    observer.expect_rest(time.monotonic())


def test_who_asks_gets_control_when_the_other_hands_over(ann: Any, bob: Any, observer: Any) -> None:
    ask(bob, "^Ask ")
    request = ann.page.get_by_test_id("lease-requests")
    expect(request).to_contain_text("my turn")
    request.get_by_role("button", name="Hand over").click()
    bob.expect_control()
    ann.expect_no_control()
    expect_keys_do_nothing(ann, observer)
    bob.drive_off(observer)
    bob.release_keys()
    observer.expect_rest(time.monotonic())


def test_who_asks_is_told_when_the_other_refuses(ann: Any, bob: Any) -> None:
    ask(bob, "^Ask ")
    ann.page.get_by_role("button", name="Not now").click()
    expect(bob.page.get_by_test_id("control-news")).to_contain_text("Not granted")
    ann.expect_control()
    bob.expect_no_control()


def test_a_supervisor_takes_over_from_who_is_driving(ann: Any, bob: Any, observer: Any) -> None:
    ann.drive_off(observer)
    ask(bob, "^Take over now$")
    bob.expect_control()
    observer.expect_rest(time.monotonic())
    expect(ann.page.get_by_test_id("control-news")).to_contain_text("no longer have control")
    ann.release_keys()
    expect_keys_do_nothing(ann, observer)
    bob.drive_off(observer)


def test_who_freezes_while_driving_stops_and_loses_control_to_who_waits(
    own_browser: Any,
    driver_of: Any,
    seated: Any,
    robot: Any,
    observer: Any,
) -> None:
    wait_for(observer.rests, "the robot rests before the test")
    frozen = driver_of(own_browser.browser.contexts[0].pages[0])
    frozen.take_control()
    with seated() as waiting:
        _waits_and_drives(waiting, frozen, own_browser, observer)


def _waits_and_drives(waiting: Any, frozen: Any, own_browser: Any, observer: Any) -> None:
    frozen.drive_off(observer)
    os.killpg(own_browser.process.pid, signal.SIGSTOP)
    froze_s = time.monotonic()
    observer.expect_rest(froze_s)
    expect(waiting.lease).to_have_attribute("data-state", "free")
    assert time.monotonic() - froze_s < LEASE_EXPIRY_S + SEEN_WITHIN_S + observer.kept_waiting_s(froze_s)
    waiting.take_control()
    waiting.drive_off(observer)
