"""What the ladder takes for a device or a host, and what it puts in its place to see whether its absence is told."""

from __future__ import annotations

from typing import Any

import pytest

from mosaic_core.ladder.absent_devices import ABSENT, NOWHERE, without_device
from mosaic_core.ladder.examinee import Examinee
from mosaic_core.ladder.shipment import found_shipments
from mosaic_core.ladder.silver_rules import absent_devices_are_gone
from tests.ladder.conftest import GoodPlugin


@pytest.mark.parametrize(
    ("params", "absent"),
    [
        ({"port": "/dev/ttyUSB0"}, {"port": ABSENT}),
        ({"anything": "/dev/i2c-1"}, {"anything": ABSENT}),
        ({"source": "video.mp4"}, {"source": f"{ABSENT}.mp4"}),
        ({"source": "rtsp://me:word@camera:554/1"}, {"source": f"rtsp://me:word@{NOWHERE}:554/1"}),
        ({"broker": "localhost"}, {"broker": NOWHERE}),
        ({"url": "http://127.0.0.1:8000/state"}, {"url": f"http://{NOWHERE}:8000/state"}),
        ({"bus": {"port": "made-up"}, "rate_hz": 5}, {"bus": {"port": ABSENT}, "rate_hz": 5}),
        ({"name": "left", "period_s": 0.5, "address": 104}, None),
    ],
)
def test_a_device_or_host_is_known_by_its_name_or_its_value(
    params: dict[str, Any], absent: dict[str, Any] | None
) -> None:
    assert [less for _, _, less in without_device(params)] == ([] if absent is None else [absent])


async def test_a_device_that_only_a_default_names_is_missed_too(plugin: GoodPlugin) -> None:
    plugin.spoil("acme_gauge/connector.py", 'raise DeviceGone("unplugged")', 'raise OSError("unplugged")')
    example = '    connector_type = "acme-gauge"\n    example = {"period_s": 0.5}\n'
    plugin.spoil("acme_gauge/connector.py", '    connector_type = "acme-gauge"\n', example)
    (shipment,) = found_shipments([str(plugin.folder)])
    (gauge,) = [one for one in shipment.connectors() if one.name == "acme-gauge"]
    faults = await absent_devices_are_gone(Examinee(shipment, gauge))
    assert [one.message for one in faults] == [f"with port: {ABSENT} it raises OSError: unplugged"]
