"""Cameras that vanish and return, and that say garbage: devices of this machine, and those by HTTP and TCP."""

from __future__ import annotations

import os
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from typing import Any

import cv2
import numpy as np
import pytest

from mosaic_camera import camera as module
from mosaic_camera.camera import Camera, CameraConfigurer
from mosaic_camera.grabbed import WantedSource
from mosaic_camera.source import CaptureSource
from mosaic_camera.source_error import SourceError
from mosaic_core import DeviceGone
from mosaic_core.testing import build, fake_host, take_frames

AWAY_TRIES = 6


class Device:
    """``cv2.VideoCapture`` of a camera that a test unplugs and disturbs. ``garbled``: which of its pictures are."""

    def __init__(self, garbled: Callable[[int], bool] = lambda number: False) -> None:
        self.is_plugged_in = True
        self.garbled = garbled
        self.number = 0
        self.opened = self.released = 0

    def opens(self, wanted: WantedSource) -> CaptureSource:
        if not self.is_plugged_in:
            raise SourceError("no /dev/video0", "plug it in")
        self.opened += 1
        return CaptureSource(self, is_live=True)

    def grab(self) -> bool:
        threading.Event().wait(0.002)
        self.number += 1
        return self.is_plugged_in

    def get(self, name: int) -> float:
        return 0.0

    def retrieve(self) -> tuple[bool, np.ndarray | None]:
        return (False, None) if self.garbled(self.number) else (True, np.zeros((4, 4, 3), np.uint8))

    def release(self) -> None:
        self.released += 1


@pytest.fixture
def device(monkeypatch: pytest.MonkeyPatch) -> Device:
    made = Device()
    monkeypatch.setattr(module, "open_source", made.opens)
    return made


def test_a_device_that_is_away_for_thirty_seconds_is_gone_and_shown_again_when_it_returns(device: Device) -> None:
    camera = build(CameraConfigurer)
    with closing(iter(camera.frames())) as pictures:
        next(pictures)
        device.is_plugged_in = False
        with pytest.raises(DeviceGone, match="was lost"):
            list(pictures)
    for _ in range(AWAY_TRIES):
        fake_host(camera).clock.advance(5.0)
        with pytest.raises(DeviceGone, match="plug it in"):
            take_frames(camera, 1)
    device.is_plugged_in = True
    assert len(take_frames(camera, 2)) == 2
    assert device.opened == 2


def test_garbage_among_a_devices_pictures_is_left_out_and_counted_and_it_stays_open(device: Device) -> None:
    device.garbled = lambda number: number % 3 == 0
    camera = build(CameraConfigurer)
    assert len(take_frames(camera, 10)) == 10
    assert device.opened == 1
    assert fake_host(camera).losses["refused"] >= 3


def test_a_device_that_gives_nothing_but_garbage_is_lost(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "FIRST_PICTURE_S", 0.4)
    device.garbled = lambda number: True
    camera = build(CameraConfigurer)
    with pytest.raises(DeviceGone, match=r"no picture from /dev/video0 for 0\.4 s"):
        take_frames(camera, 1)
    assert fake_host(camera).losses["refused"] >= 3


class Peer:
    """A network camera on one port: ``says`` gives what it sends to each who connects."""

    def __init__(self) -> None:
        self.port = 0
        self.says: Callable[[], Iterator[bytes]] = lambda: iter(())
        self.ending = threading.Event()

    @contextmanager
    def here(self) -> Iterator[None]:
        self.ending.clear()
        with socket.create_server(("127.0.0.1", self.port)) as listener:
            self.port = listener.getsockname()[1]
            listener.settimeout(0.05)
            thread = threading.Thread(target=self._serve, args=(listener,))
            thread.start()
            try:
                yield
            finally:
                self.ending.set()
                thread.join()

    def _serve(self, listener: socket.socket) -> None:
        while not self.ending.is_set():
            try:
                connection, _ = listener.accept()
            except TimeoutError:
                continue
            with connection:
                connection.settimeout(0.2)
                self._talk(connection)

    def _talk(self, connection: socket.socket) -> None:
        for piece in self.says():
            view = memoryview(piece)
            while view:
                if self.ending.is_set():
                    return
                try:
                    view = view[connection.send(view) :]
                except TimeoutError:
                    continue  # it is read more slowly than it is said
                except OSError:
                    return  # nobody reads any more


HEAD = b"HTTP/1.1 200 OK\r\nContent-Type: multipart/x-mixed-replace; boundary=picture\r\n\r\n"


def mjpeg(garbage_every: int = 0) -> Iterator[bytes]:
    yield HEAD
    wait = threading.Event().wait
    for number in range(1, 100_000):
        data = cv2.imencode(".jpg", np.full((48, 64, 3), number % 250, np.uint8))[1].tobytes()
        if garbage_every and number % garbage_every == 0:
            data = os.urandom(len(data))
        yield b"--picture\r\nContent-Type: image/jpeg\r\nContent-Length: %d\r\n\r\n%b\r\n" % (len(data), data)
        wait(0.01)


@pytest.fixture
def peer() -> Peer:
    return Peer()


def of_http(peer: Peer) -> Camera:
    made: Any = build(CameraConfigurer, params={"source": f"http://127.0.0.1:{peer.port}/video"})
    return made  # type: ignore[no-any-return]


def test_an_http_camera_that_is_away_for_thirty_seconds_is_gone_and_shown_again_when_it_returns(peer: Peer) -> None:
    peer.says = mjpeg
    with peer.here():
        camera = of_http(peer)
        pictures = iter(camera.frames())
        fake_host(camera).arm()
        next(pictures)
    with pytest.raises(DeviceGone, match="was lost"):
        list(pictures)
    for _ in range(AWAY_TRIES):
        fake_host(camera).clock.advance(5.0)
        with pytest.raises(DeviceGone, match="no video from"):
            take_frames(camera, 1)
    with peer.here():
        assert len(take_frames(camera, 2)) == 2


def test_garbage_among_the_pictures_of_an_http_camera_does_not_end_it_for_good(peer: Peer) -> None:
    """The decoder may give the connection up; then it is opened anew, as the runner would."""
    peer.says = lambda: mjpeg(garbage_every=5)
    seen = 0
    with peer.here():
        camera = of_http(peer)
        for _ in range(10):
            try:
                seen += len(take_frames(camera, 12))
            except DeviceGone:
                seen += len(fake_host(camera).pictures)
            if seen >= 12:
                break
    assert seen >= 12


@pytest.mark.parametrize("scheme", ["http", "tcp"])
def test_a_server_that_says_garbage_is_a_device_that_is_gone(peer: Peer, scheme: str) -> None:
    def garbage() -> Iterator[bytes]:
        yield HEAD if scheme == "http" else b""
        yield os.urandom(100_000)

    peer.says = garbage
    with peer.here():
        camera = build(CameraConfigurer, params={"source": f"{scheme}://127.0.0.1:{peer.port}/video.mjpg"})
        with pytest.raises(DeviceGone):
            take_frames(camera, 1)
