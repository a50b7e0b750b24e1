"""What `mosaic doctor` says of cameras."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest

from mosaic_camera.camera import CameraParams
from mosaic_camera.devices import VideoDevice
from mosaic_camera.doctor import devices_finding, examine
from mosaic_core.contract.checks import CheckContext, NamedConnector
from mosaic_core.words.finding import Finding


def found(*sources: str) -> list[Finding]:
    cameras = tuple(
        NamedConnector("camera", f"cam{number}", CameraParams(source=source)) for number, source in enumerate(sources)
    )

    async def collect() -> list[Finding]:
        return [finding async for finding in examine(CheckContext(cameras))]

    return asyncio.run(collect())


def test_a_camera_that_is_not_there_is_told_with_its_label_and_a_cure() -> None:
    _, finding = found("/dev/video99")
    assert (finding.check, finding.status, finding.code) == ("camera.cam0", "fail", "plugin.no_device")
    assert finding.sentence.startswith("cam0: no such camera: /dev/video99")
    assert finding.cure


def test_a_recording_that_can_not_be_opened_is_told(tmp_path: Path) -> None:
    path = tmp_path / "broken.avi"
    path.write_bytes(b"no picture")
    _, finding = found(str(path))
    assert finding.status == "fail"


def test_devices_of_this_machine_are_named_and_closed_ones_have_their_cure(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert devices_finding([]).status == "skipped"
    path = tmp_path / "video0"
    path.touch()
    device = VideoDevice(path, "Webcam")
    assert "Webcam" in devices_finding([device]).sentence
    monkeypatch.setattr("os.access", lambda *_: False)
    closed = devices_finding([device])
    assert (closed.code, "usermod" in closed.cure) == ("plugin.no_permission", True)
