"""H.264 over a plain TCP connection, raw or in a transport stream, as `rpicam-vid --listen` and GStreamer's
`tcpserversink` give it: passed on without being decoded."""

import io
import socket
import threading
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from fractions import Fraction

import av
import numpy as np
import pytest

from mosaic_camera.grabbed import Grabbed, WantedSource
from mosaic_camera.packet_source import PacketSource
from mosaic_camera.source import open_source
from mosaic_camera.source_error import SourceError

PICTURES = 60
KEY_EVERY = 15


def recorded(form: str) -> bytes:
    """Pictures with their headers before each key frame, as `--inline` asks for."""
    written = io.BytesIO()
    with av.open(written, "w", format=form) as container:
        headers = f"keyint={KEY_EVERY}:repeat-headers=1"
        stream = container.add_stream(
            "libx264", rate=30, options={"preset": "ultrafast", "tune": "zerolatency", "x264-params": headers}
        )
        stream.width, stream.height, stream.pix_fmt = 160, 120, "yuv420p"
        for number in range(PICTURES):
            frame = av.VideoFrame.from_ndarray(np.full((120, 160, 3), 4 * number, np.uint8), format="rgb24")
            frame.pts, frame.time_base = number, Fraction(1, 30)
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))
    return written.getvalue()


@contextmanager
def camera_that_sends(sent: bytes) -> Iterator[str]:
    """One camera that sends to who connects, then ends the connection."""

    def serve() -> None:
        connection, _ = listener.accept()
        with connection:
            connection.sendall(sent)

    with socket.create_server(("127.0.0.1", 0)) as listener:
        thread = threading.Thread(target=serve)
        thread.start()
        yield f"tcp://127.0.0.1:{listener.getsockname()[1]}"
        thread.join()


@pytest.mark.parametrize("form", ["h264", "mpegts"])
def test_h264_over_tcp_is_passed_on_as_it_is(form: str) -> None:
    grabbed: list[Grabbed] = []
    with camera_that_sends(recorded(form)) as url:
        source = open_source(WantedSource(url, passes_packets=True))
        assert isinstance(source, PacketSource)
        assert source.is_live
        while (one := source.read()) is not None:
            grabbed.append(one)
        source.close()
    assert all(isinstance(one.image, av.Packet) for one in grabbed)
    assert [place for place, one in enumerate(grabbed) if one.is_key] == list(range(0, PICTURES, KEY_EVERY))
    assert len(grabbed) == PICTURES


@pytest.mark.parametrize("form", ["h264", "mpegts"])
def test_garbage_within_a_stream_is_passed_on_or_ends_it_and_is_never_a_bug(form: str) -> None:
    """What is no unit of H.264 is a matter of the operator's decoder, which waits for the next key frame."""
    dice, sent = np.random.default_rng(7), bytearray(recorded(form))
    for place in dice.integers(len(sent) // 2, len(sent), 40):
        sent[place] = dice.integers(256)
    count = 0
    with (
        camera_that_sends(bytes(sent)) as url,
        closing(open_source(WantedSource(url, passes_packets=True))) as source,
        suppress(SourceError),
    ):
        while source.read() is not None:
            count += 1
    assert count >= PICTURES // 4
