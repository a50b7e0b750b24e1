"""A real RTSP server, GStreamer's: its pictures arrive, its H.264 as it is; it may go and return, and whoever asks it
wrongly is told why, without the password."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Iterator
from pathlib import Path

import av
import numpy as np
import pytest

from mosaic_camera.camera import Camera, CameraConfigurer
from mosaic_core import Captured
from mosaic_core.testing import build, fake_host, take_frames
from mosaic_core.words.errors import DeviceGone

PYTHON = "/usr/bin/python3"
"""Debian's, which has GStreamer's binding."""
PROGRAM = Path(__file__).with_name("rtsp_server.py")
PACKAGES = "python3-gst-1.0 gir1.2-gst-rtsp-server-1.0 gstreamer1.0-plugins-good gstreamer1.0-plugins-bad"
SECRET = "pa55word"  # noqa: S105 - of a server on loopback


class RtspServer:
    """Serves test pictures on a port that stays the same over a restart."""

    def __init__(self) -> None:
        self.port = 0
        self._process: subprocess.Popen[str] | None = None

    def start(self, *credentials: str) -> None:
        """Returns when it listens."""
        command = [PYTHON, str(PROGRAM), str(self.port), *credentials]
        self._process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            _, told = self._process.communicate()
            missing = f"no RTSP server ({told.strip().splitlines()[-1]}): apt install {PACKAGES}"
            pytest.fail(missing) if os.environ.get("CI") else pytest.skip(missing)
        self.port = int(line)

    def stop(self) -> None:
        if self._process is not None:
            self._process.kill()
            self._process.communicate()
            self._process = None

    def camera(self, path: str, credentials: str = "", **params: object) -> Camera:
        source = f"rtsp://{credentials}127.0.0.1:{self.port}/{path}"
        camera = build(CameraConfigurer, params={"source": source, **params})
        assert isinstance(camera, Camera)
        return camera


@pytest.fixture
def stopped_server() -> Iterator[RtspServer]:
    if not Path(PYTHON).exists():
        pytest.skip(f"no {PYTHON}, whose GStreamer could be used")
    server = RtspServer()
    yield server
    server.stop()


@pytest.fixture
def server(stopped_server: RtspServer) -> RtspServer:
    stopped_server.start()
    return stopped_server


def images_of(camera: Camera, count: int) -> list[object]:
    return [one.image for one in take_frames(camera, count) if isinstance(one, Captured)]


def test_its_h264_is_passed_on_as_it_is_and_can_be_decoded(server: RtspServer) -> None:
    packets = images_of(server.camera("h264"), 20)
    assert all(isinstance(one, av.Packet) for one in packets)
    decoder = av.CodecContext.create("h264", "r")
    shapes = {frame.format.name: (frame.width, frame.height)
              for one in packets for frame in decoder.decode(av.Packet(bytes(one)))}  # type: ignore[attr-defined,call-overload]  # fmt: skip
    assert shapes == {"yuv420p": (320, 240)}


@pytest.mark.parametrize("path", ["h264", "jpeg"])
def test_its_pictures_are_decoded_where_they_cannot_be_passed_on(server: RtspServer, path: str) -> None:
    images = images_of(server.camera(path, width=160), 3)
    assert [one.shape for one in images if isinstance(one, np.ndarray)] == [(120, 160, 3)] * 3


@pytest.mark.parametrize("path", ["h264", "jpeg"])
def test_a_server_that_goes_is_a_device_that_is_gone_and_one_that_returns_is_shown_again(
    server: RtspServer, path: str
) -> None:
    camera = server.camera(path)
    fake_host(camera).arm()
    pictures = iter(camera.frames())
    next(pictures)
    server.stop()
    with pytest.raises(DeviceGone, match=r"lost|broke off"):
        list(pictures)
    with pytest.raises(DeviceGone, match="no video from"):
        images_of(camera, 1)

    server.start()
    assert len(images_of(camera, 2)) == 2


@pytest.mark.parametrize("passthrough", ["auto", "never"])
@pytest.mark.parametrize("wrong", ["password", "path", "port"])
def test_who_asks_it_wrongly_is_told_what_to_check_and_never_the_password(
    stopped_server: RtspServer,
    wrong: str,
    passthrough: str,
    caplog: pytest.LogCaptureFixture,
    capfd: pytest.CaptureFixture[str],
) -> None:
    stopped_server.start("viewer", "another" if wrong == "password" else SECRET)
    if wrong == "port":
        stopped_server.stop()
    path = "nowhere" if wrong == "path" else "h264"
    camera = stopped_server.camera(path, f"viewer:{SECRET}@", passthrough=passthrough)
    with caplog.at_level("DEBUG"), pytest.raises(DeviceGone, match="check that the address, user and") as gone:
        images_of(camera, 1)
    assert SECRET not in "".join([str(gone.value), gone.value.cure or "", caplog.text, *capfd.readouterr()])


def test_who_knows_the_password_sees_it(stopped_server: RtspServer) -> None:
    stopped_server.start("viewer", SECRET)
    assert len(images_of(stopped_server.camera("h264", f"viewer:{SECRET}@"), 2)) == 2
