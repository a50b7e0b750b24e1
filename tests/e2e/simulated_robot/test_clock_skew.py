"""An operator's clock that is an hour wrong changes nothing: not the driving, not the speed, not the stopping."""

from __future__ import annotations

import time
from contextlib import closing
from typing import Any

import pytest
from playwright.sync_api import expect
from support.waiting import wait_for

pytestmark = [pytest.mark.e2e, pytest.mark.timeout(180)]

WRONG_CLOCK = """(() => {
  const skewMs = %d
  const OriginalDate = Date
  const origin = performance.timeOrigin
  Object.defineProperty(performance, 'timeOrigin', { get: () => origin + skewMs })
  globalThis.Date = class extends OriginalDate {
    constructor(...parts) { parts.length === 0 ? super(OriginalDate.now() + skewMs) : super(...parts) }
    static now() { return OriginalDate.now() + skewMs }
  }
})()"""


@pytest.mark.parametrize("skew_s", [3600, -3600], ids=["ahead", "behind"])
def test_an_hour_of_clock_skew_changes_nothing(skew_s: int, browser: Any, driver_of: Any, observer: Any) -> None:
    wait_for(observer.rests, "the robot rests before the test")
    with closing(browser.new_context(viewport={"width": 1280, "height": 900})) as context:
        context.add_init_script(WRONG_CLOCK % (1000 * skew_s))
        person = driver_of(context.new_page())
        assert abs(person.page.evaluate("() => Date.now()") / 1000 - time.time() - skew_s) < 60
        person.take_control()
        start_s = time.monotonic()
        person.hold_keys()
        wait_for(lambda: observer.way_m(start_s) > 0.3, "the robot moves while the key is held")
        expect(person.page.get_by_test_id("control-frame")).to_have_attribute("data-tone", "none")
        person.release_keys()
        observer.expect_rest(time.monotonic())
