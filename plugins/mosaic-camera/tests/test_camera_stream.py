"""A network stream: an MJPEG camera on loopback, as cheap network cameras serve it."""

import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import cv2
import numpy as np
import pytest

from mosaic_camera.camera import CameraConfigurer
from mosaic_camera.marks import draw_marks, read_marks
from mosaic_camera.source_error import SourceError
from mosaic_core import Captured
from mosaic_core.testing import build, fake_host, take_frames

PICTURES = 40


class MjpegCamera(BaseHTTPRequestHandler):
    """Serves numbered pictures at about 50 per second, then is unplugged."""

    def do_GET(self) -> None:
        self.send_response(200)
        self.send_header("Content-Type", "multipart/x-mixed-replace; boundary=picture")
        self.end_headers()
        for number in range(PICTURES):
            image = np.full((240, 320, 3), 90, dtype=np.uint8)
            draw_marks(image, number, 0.0)
            data = cv2.imencode(".jpg", image)[1].tobytes()
            head = f"--picture\r\nContent-Type: image/jpeg\r\nContent-Length: {len(data)}\r\n\r\n"
            try:
                self.wfile.write(head.encode() + data + b"\r\n")
            except OSError:
                return
            self.server.ending.wait(0.02)  # type: ignore[attr-defined]

    def log_message(self, *_: object) -> None: ...


@pytest.fixture
def stream_url() -> Iterator[str]:
    server = ThreadingHTTPServer(("127.0.0.1", 0), MjpegCamera)
    server.ending = threading.Event()  # type: ignore[attr-defined]
    thread = threading.Thread(target=server.serve_forever, args=(0.05,))
    thread.start()
    yield f"http://127.0.0.1:{server.server_address[1]}/video"
    server.ending.set()  # type: ignore[attr-defined]
    server.shutdown()
    thread.join()
    server.server_close()


def test_a_stream_is_shown_and_its_loss_is_told(stream_url: str) -> None:
    camera = build(CameraConfigurer, params={"source": stream_url})
    with pytest.raises(SourceError, match=r"127\.0\.0\.1:\d+/video was lost"):
        take_frames(camera)
    pictures = fake_host(camera).pictures
    marks = [read_marks(np.asarray(picture.image)) for picture in pictures if isinstance(picture, Captured)]
    numbers = [mark.frame for mark in marks if mark]
    assert len(numbers) >= 3
    assert numbers == sorted(set(numbers))
