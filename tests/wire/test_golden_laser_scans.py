"""The golden scans: the same bytes from Python and to TypeScript."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import pytest

from mosaic_core.words.errors import WireError

laser_scan = pytest.importorskip("mosaic_sensors.laser_scan", reason="mosaic-sensors is not installed")

GOLDEN = json.loads((Path(__file__).parent / "payloads" / "laser_scans.json").read_text())
SCANS = [pytest.param(entry, id=entry["name"]) for entry in GOLDEN["scans"]]


@pytest.mark.parametrize("entry", SCANS)
def test_the_bytes_of_a_golden_scan_are_read_as_the_scan(entry: dict[str, Any]) -> None:
    scan, wanted = laser_scan.decoded_scan(bytes.fromhex(entry["hex"])), entry["scan"]
    ranges = [None if math.isnan(one) else pytest.approx(one, abs=5e-4) for one in scan.ranges_m.tolist()]
    assert wanted["ranges"] == ranges
    assert (scan.angle_min_rad, scan.angle_increment_rad) == (wanted["angle_min"], wanted["angle_increment"])
    assert (scan.range_min_m, scan.range_max_m) == (wanted["range_min"], wanted["range_max"])
    assert (scan.frame_id, scan.captured_at_s) == (wanted["frame_id"], wanted["captured_at_s"])
    intensities = None if scan.intensities is None else scan.intensities.tolist()
    assert intensities == (None if wanted["intensities"] is None else pytest.approx(wanted["intensities"], abs=0.05))


@pytest.mark.parametrize("entry", SCANS)
def test_a_golden_scan_is_encoded_to_its_bytes(entry: dict[str, Any]) -> None:
    wanted = entry["scan"]
    scan = laser_scan.scan_of_json(wanted, wanted["captured_at_s"], wanted["frame_id"])
    data = laser_scan.encoded_scan(scan, deflate=entry["deflated"])
    if not entry["deflated"]:  # how deflate spells it may differ from one zlib to another
        assert data.hex() == entry["hex"]
    assert laser_scan.decoded_scan(data).ranges_m.tolist() == pytest.approx(
        scan.ranges_m.tolist(), abs=5e-4, nan_ok=True
    )


@pytest.mark.parametrize("text", GOLDEN["malformed_hex"])
def test_malformed_scans_are_refused(text: str) -> None:
    with pytest.raises(WireError):
        laser_scan.decoded_scan(bytes.fromhex(text))
