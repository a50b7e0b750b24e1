"""How the data of a card travels, as a person sees it in Chromium."""

from __future__ import annotations

import re
from typing import Any

import pytest
from playwright.sync_api import expect
from support.people import photographed

pytestmark = pytest.mark.e2e


def test_the_menu_of_a_card_tells_how_its_data_travels_on_both_sides(driver: Any) -> None:
    page = driver.page
    page.get_by_role("button", name="Menu of pose").click()
    page.get_by_role("menuitem", name="Delivery").click()
    sheet = page.get_by_role("table", name="Delivery of pose")
    rate = sheet.get_by_role("row", name=re.compile("^rate"))
    fast = re.compile(r"[1-9][0-9]\.[0-9]/s · [0-9.]+ KB/s")
    expect(rate.get_by_role("cell").nth(0)).to_have_text(fast, timeout=15_000)
    expect(rate.get_by_role("cell").nth(1)).to_have_text(fast)
    expect(sheet.get_by_text("latest: the newest value only")).to_be_visible()
    expect(page.get_by_test_id("drop-mark")).to_have_count(0)
    photographed(page, "delivery")
    page.get_by_role("heading", name="battery").click()  # not Escape: twice that is a stop
    expect(sheet).to_have_count(0)
