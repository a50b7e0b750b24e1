"""A receiver that is made up: it walks a circle, and its position becomes exact when it hears corrections."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from pyubx2 import GET, UBXMessage  # type: ignore[import-untyped]

from mosaic_sensors.ubx.rtcm import PREAMBLE

PERIOD_S = 0.2
RADIUS_DEG = 0.0003
LATITUDE_DEG, LONGITUDE_DEG = 52.0, 4.3
TURN_S = 120.0


def encoded_solution(**fields: Any) -> bytes:
    """NAV-PVT with a fix of nine satellites, and whatever ``fields`` say."""
    said = {
        "fixType": 3, "gnssFixOk": 1, "numSV": 9, "hAcc": 1500,
        "lat": LATITUDE_DEG, "lon": LONGITUDE_DEG, "height": 57_000,
        **fields,
    }  # fmt: skip
    frame: bytes = UBXMessage("NAV", "NAV-PVT", GET, **said).serialize()
    return frame


class FakeUbxReceiver:
    """Tells its solution five times a second."""

    def __init__(self) -> None:
        self._is_corrected = False

    def pieces(self) -> Iterator[tuple[float, bytes]]:
        """What it says: a pause in seconds, and the bytes after it. Without end."""
        tick = 0
        while True:
            angle = tick * PERIOD_S / TURN_S * math.tau
            corrected = {"carrSoln": 2, "diffSoln": 1, "hAcc": 14} if self._is_corrected else {}
            yield (
                PERIOD_S,
                encoded_solution(
                    lat=round(LATITUDE_DEG + RADIUS_DEG * math.sin(angle), 7),
                    lon=round(LONGITUDE_DEG + RADIUS_DEG * math.cos(angle), 7),
                    **corrected,
                ),
            )
            tick += 1

    def hear(self, data: bytes) -> None:
        """What is written to it. Any thread."""
        self._is_corrected = self._is_corrected or data[0] == PREAMBLE
