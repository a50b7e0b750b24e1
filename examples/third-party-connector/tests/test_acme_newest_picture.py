"""The newest picture of a folder, without a camera and without waiting."""

from __future__ import annotations

import os
from pathlib import Path

import cv2
import numpy as np
import pytest
from acme_workbench.newest_picture import NewestPictureConfigurer

from mosaic_core import DeviceGone
from mosaic_core.testing import FakeHost, build, fake_host, take_frames


def write_picture(path: Path, brightness: int, written_s: float) -> None:
    cv2.imwrite(str(path), np.full((48, 64, 3), brightness, np.uint8))
    os.utime(path, (written_s, written_s))


def test_it_shows_the_one_that_was_written_last(tmp_path: Path) -> None:
    write_picture(tmp_path / "b.png", 10, written_s=1000)
    write_picture(tmp_path / "a.png", 200, written_s=2000)
    (picture,) = take_frames(build(NewestPictureConfigurer, params={"folder": str(tmp_path)}), 1)
    assert picture.shape == (48, 64, 3)
    assert picture.max() == 200


def test_one_that_is_half_written_is_not_shown_before_it_is_whole(tmp_path: Path) -> None:
    half = tmp_path / "half.png"
    write_picture(half, 120, written_s=1000)
    half.write_bytes(half.read_bytes()[:20])

    class Host(FakeHost):
        def wait(self, seconds: float) -> bool:
            write_picture(half, 120, written_s=1000)
            return super().wait(seconds)

    camera = build(NewestPictureConfigurer, params={"folder": str(tmp_path)})
    camera.bind(Host())
    assert next(iter(camera.frames())).max() == 120
    assert fake_host(camera).clock.now_s > FakeHost().clock.now_s


def test_an_empty_folder_is_a_device_that_is_gone(tmp_path: Path) -> None:
    with pytest.raises(DeviceGone, match=r"no \*\.png in"):
        take_frames(build(NewestPictureConfigurer, params={"folder": str(tmp_path)}), 1)


def test_a_picture_that_nobody_took_needs_no_folder() -> None:
    (picture,) = take_frames(build(NewestPictureConfigurer, params={"folder": "made-up"}), 1)
    assert picture.shape == (120, 160, 3)
