"""Two thousand echoes at once toward an original operator: each comes back in order, or the robot has counted it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

pytestmark = pytest.mark.webrtc

LINK = "  - { type: connection-check, label: link }\n"
BURST = 2000


@pytest.mark.parametrize("size", [10, 1000])
async def test_a_burst_of_echoes_is_delivered_or_counted(
    original_robot: Any, until: Any, size: int, record_property: Callable[[str, object], None]
) -> None:
    async with original_robot(LINK) as site:
        page = site.operator("link-sender", "link-receiver")
        await page.connect()
        for number in range(BURST):
            page.channels["link-receiver"].send(f"{number} ".ljust(size, "x"))

        def lost() -> int:
            rows = site.snapshots[-1]["connectors"] if site.snapshots else []
            return sum(row["dropped"] + row["refused"] for row in rows)

        await until(lambda: len(page.received["link-sender"]) + lost() == BURST, "all are accounted for")
        numbers = [int(text.split()[0]) for text in page.received["link-sender"]]
        assert numbers == sorted(set(numbers))
        assert len(numbers) > BURST // 10
        record_property("delivered", len(numbers))
        await site.is_alive()
    record_property(
        "pair", f"our robot ↔ operator on aiortc alone: {BURST} echoes of {size} bytes, delivered or counted"
    )
