"""A page about a device says what was tried, so that nobody takes a device that is made up for one that was there."""

from __future__ import annotations

from pathlib import Path

import pytest

HOWTO = Path(__file__).parents[2] / "docs" / "howto"
PAGES = ("ros2", "mavlink", "arm", "can", "gpio", "imu", "lidar", "gps", "joystick", "modbus")


@pytest.mark.parametrize("page", PAGES)
def test_the_page_of_a_device_says_what_was_at_hand(page: str) -> None:
    tried = (HOWTO / f"{page}.md").read_text().partition("## What was tried\n")[2].partition("\n## ")[0]
    assert "at hand" in tried
