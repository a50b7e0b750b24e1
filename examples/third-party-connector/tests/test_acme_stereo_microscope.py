"""The stereo microscope: two pictures and a light of one connector, each for itself."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from acme_workbench.stereo_microscope import StereoMicroscopeConfigurer

from mosaic_core.testing import build, connector, feed, joined, take_frames

BRIGHTNESS = {"left": 40, "right": 200}


@pytest.fixture
def params(tmp_path: Path) -> dict[str, Any]:
    for eye, brightness in BRIGHTNESS.items():
        (tmp_path / eye).mkdir()
        cv2.imwrite(str(tmp_path / eye / "a.png"), np.full((48, 64, 3), brightness, np.uint8))
    (tmp_path / "max_brightness").write_text("200\n")
    return {"folder": str(tmp_path), "led": str(tmp_path), "fps": 20}


def test_each_eye_sees_its_own_folder_and_the_light_shines(params: dict[str, Any], tmp_path: Path) -> None:
    left, right, light = build(StereoMicroscopeConfigurer, label="scope", params=params)
    assert [one.label for one in (left, right, light)] == ["scope_left", "scope_right", "scope_light"]
    assert [take_frames(eye, 1)[0].max() for eye in (left, right)] == [*BRIGHTNESS.values()]
    feed(light, [{"brightness_percent": 50}])
    assert (tmp_path / "brightness").read_text() == "100"


def test_without_a_microscope_there_are_pictures_too() -> None:
    left, right, _ = build(StereoMicroscopeConfigurer, params={"folder": "made-up", "led": "made-up"})
    assert take_frames(left, 1)[0].shape == take_frames(right, 1)[0].shape == (120, 160, 3)


async def test_an_operator_looks_through_either_eye(params: dict[str, Any]) -> None:
    async with joined(connector(StereoMicroscopeConfigurer, label="scope", params=params)) as link:
        for eye, brightness in BRIGHTNESS.items():
            picture = await link.connection.media(f"scope_{eye}").next_image()
            assert int(picture.mean()) == brightness
