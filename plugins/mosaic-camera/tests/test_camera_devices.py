"""Which cameras there are, and why one can't be opened: each error has a cure."""

import os
from pathlib import Path

import pytest

from mosaic_camera.devices import VideoDevice, check_device, found_devices
from mosaic_camera.source_error import SourceError


def test_devices_are_listed_in_the_order_of_their_numbers(tmp_path: Path) -> None:
    for number in (10, 2, 0):
        entry = tmp_path / f"video{number}"
        entry.mkdir()
        (entry / "name").write_text(f"Cam {number}\n")
    devices = found_devices(tmp_path, Path("/dev"))
    assert devices == [VideoDevice(Path(f"/dev/video{n}"), f"Cam {n}") for n in (0, 2, 10)]


def test_a_device_without_a_name_is_listed_all_the_same(tmp_path: Path) -> None:
    (tmp_path / "video0").mkdir()
    assert found_devices(tmp_path)[0].name == "unnamed"


def test_a_machine_without_video4linux_has_no_devices(tmp_path: Path) -> None:
    assert found_devices(tmp_path / "absent") == []


def test_an_absent_camera_names_those_that_are_there() -> None:
    devices = [VideoDevice(Path("/dev/video2"), "HD Webcam")]
    with pytest.raises(SourceError, match=r"no such camera: /dev/absent9; found: /dev/video2 \(HD Webcam\); set"):
        check_device(Path("/dev/absent9"), devices)


def test_an_absent_camera_where_there_is_none_says_plug_it_in() -> None:
    with pytest.raises(SourceError, match="found: none; plug the camera in"):
        check_device(Path("/dev/absent9"), [])


def test_a_camera_without_permission_names_the_group(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    node = tmp_path / "video0"
    node.touch()
    monkeypatch.setattr(os, "access", lambda *_: False)
    with pytest.raises(SourceError, match="usermod -aG video") as caught:
        check_device(node, [])
    assert caught.value.cure
    assert caught.value.code == "plugin.no_device"


def test_a_camera_that_is_there_and_allowed_passes(tmp_path: Path) -> None:
    node = tmp_path / "video0"
    node.touch()
    check_device(node, [])
