"""H.264 that a source has already is passed on, whole and in order; everything else is decoded as before."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from fractions import Fraction
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any, cast

import av
import numpy as np
import pytest

from mosaic_camera.camera import Camera, CameraConfigurer
from mosaic_camera.marks import draw_marks, read_marks
from mosaic_camera.packet_source import open_packets
from mosaic_camera.source import may_have_packets
from mosaic_camera.source_error import SourceError
from mosaic_core import Captured
from mosaic_core.testing import FakeClock, build, fake_host, take_frames

PICTURES, KEY_EVERY = 12, 4


def recorded(path: Path, *, codec: str = "libx264", b_frames: int = 0) -> Path:
    """A recording whose pictures carry their numbers, every fourth one a key frame."""
    with av.open(str(path), "w") as container:
        stream = cast(Any, container.add_stream(codec, rate=10))
        stream.width, stream.height, stream.pix_fmt = 320, 240, "yuv420p"
        stream.codec_context.gop_size = KEY_EVERY
        stream.codec_context.max_b_frames = b_frames
        if codec == "libx264":
            stream.options = {"preset": "ultrafast", "x264-params": f"bframes={b_frames}:scenecut=0"}
        for number in range(PICTURES):
            image = np.full((240, 320, 3), 40 + 10 * number, dtype=np.uint8)
            draw_marks(image, number, number / 10)
            frame = av.VideoFrame.from_ndarray(image, format="bgr24")
            frame.pts, frame.time_base = number, Fraction(1, 10)
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))
    return path


def packets_of(pictures: Any) -> list[Any]:
    packets = [picture.image for picture in pictures if isinstance(picture, Captured)]
    assert all(isinstance(packet, av.Packet) for packet in packets)
    return packets


def decoded_numbers(packets: list[Any]) -> list[int]:
    decoder = cast(Any, av.CodecContext.create("h264", "r"))
    decoder.extradata = packets[0].stream.codec_context.extradata
    images = [
        frame.to_ndarray(format="bgr24")
        for data in (*map(bytes, packets), None)
        for frame in decoder.decode(None if data is None else av.Packet(data))
    ]
    marks = [read_marks(image) for image in images]
    return [mark.frame for mark in marks if mark is not None]


@pytest.mark.parametrize("name", ["clip.mp4", "clip.mkv", "clip.ts", "clip.h264"])
def test_h264_of_a_file_is_passed_on_as_it_is(tmp_path: Path, name: str) -> None:
    camera = build(CameraConfigurer, params={"source": str(recorded(tmp_path / name)), "loop": False})
    packets = packets_of(take_frames(camera))
    assert len(packets) == PICTURES
    assert [packet.is_keyframe for packet in packets] == [number % KEY_EVERY == 0 for number in range(PICTURES)]
    assert decoded_numbers(packets) == list(range(PICTURES))
    assert decoded_numbers(packets[KEY_EVERY:]) == list(range(KEY_EVERY, PICTURES)), "whoever joins at a key frame"
    assert camera.packet_codec == "h264"


def test_a_file_of_packets_is_paced_and_looped_like_any_other(tmp_path: Path, fake_clock: FakeClock) -> None:
    path = recorded(tmp_path / "clip.mp4")
    camera = build(CameraConfigurer, params={"source": str(path)}, clock=fake_clock)
    began_s = fake_clock.now_s
    pictures = take_frames(camera, 20)
    times_s = [picture.captured_at_s for picture in pictures if isinstance(picture, Captured)]
    assert times_s == pytest.approx([began_s + number / 10 for number in range(20)], abs=0.02)
    assert decoded_numbers(packets_of(pictures)) == [*range(PICTURES), *range(8)]


@pytest.mark.parametrize(
    "params", [{"passthrough": "never"}, {"width": 160}, {"fps": 5}, {"rotation": 90}, {"flip": "vertical"}]
)
def test_what_must_be_changed_is_decoded(tmp_path: Path, params: dict[str, object]) -> None:
    path = recorded(tmp_path / "clip.mp4")
    camera = build(CameraConfigurer, params={"source": str(path), **params})
    (picture,) = take_frames(camera, 1)
    assert isinstance(picture, Captured)
    assert isinstance(picture.image, np.ndarray)
    assert camera.packet_codec is None


def test_pictures_that_refer_to_later_ones_are_decoded(tmp_path: Path) -> None:
    path = recorded(tmp_path / "clip.mp4", b_frames=2)
    assert open_packets(str(path)) is None
    (picture,) = take_frames(build(CameraConfigurer, params={"source": str(path)}), 1)
    assert isinstance(picture, Captured)
    assert isinstance(picture.image, np.ndarray)


def test_another_codec_is_decoded(tmp_path: Path) -> None:
    path = recorded(tmp_path / "clip.mp4", codec="mpeg4")
    assert open_packets(str(path)) is None


def test_what_can_not_be_opened_is_left_to_the_one_who_knows_the_words(tmp_path: Path) -> None:
    assert open_packets(str(tmp_path / "gone.mp4")) is None


def test_only_containers_and_streaming_addresses_are_looked_into() -> None:
    looked_into = ["rtsp://cam/1", "rtsp://u:p@cam:554/h264", "a.MP4", "/x/a.ts", "http://cam/live.m3u8?x=1"]
    others = ["/dev/video0", "0", "http://cam/video", "http://cam/mjpg.cgi", "notes.avi"]
    assert [may_have_packets(source) for source in looked_into + others] == [True] * 5 + [False] * 5


def test_a_wish_for_another_codec_is_not_overruled(tmp_path: Path) -> None:
    camera = build(CameraConfigurer, params={"source": str(recorded(tmp_path / "clip.mp4")), "codec": "vp8"})
    assert isinstance(camera, Camera)
    assert camera.encoding.codec == "vp8"


class Quiet(SimpleHTTPRequestHandler):
    def log_message(self, *_: object) -> None: ...


@pytest.fixture
def served(tmp_path: Path) -> Iterator[str]:
    recorded(tmp_path / "live.ts")
    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(Quiet, directory=str(tmp_path)))
    thread = threading.Thread(target=server.serve_forever, args=(0.05,))
    thread.start()
    yield f"http://127.0.0.1:{server.server_address[1]}/live.ts"
    server.shutdown()
    thread.join()
    server.server_close()


def test_h264_from_the_network_is_passed_on_until_the_stream_is_lost(served: str) -> None:
    camera = build(CameraConfigurer, params={"source": served})
    with pytest.raises(SourceError, match="was lost"):
        take_frames(camera)
    assert decoded_numbers(packets_of(fake_host(camera).pictures)) == list(range(PICTURES))


@pytest.fixture
def encoding_camera(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[str, list[dict[str, Any]]]:
    """A device node behind which a recording plays the camera that encodes, and how it was opened."""
    node, recording = tmp_path / "video7", recorded(tmp_path / "clip.mp4")
    opened: list[dict[str, Any]] = []
    node.touch()
    real = av.open

    def play(path: str, *words: Any, **options: Any) -> Any:
        if options.get("format") != "v4l2":
            return real(path, *words, **options)
        opened.append({"path": path, **options})
        return real(str(recording))

    monkeypatch.setattr(av, "open", play)
    for module in ("source", "camera"):
        monkeypatch.setattr(f"mosaic_camera.{module}.is_device", lambda source: source == str(node))
    return str(node), opened


def test_the_h264_of_a_cameras_own_encoder_is_passed_on_in_the_mode_asked_for(
    encoding_camera: tuple[str, list[dict[str, Any]]],
) -> None:
    node, opened = encoding_camera
    asked = {"source": node, "passthrough": "device", "width": 1280, "height": 720, "fps": 5}
    camera = build(CameraConfigurer, params=asked)
    assert camera.packet_codec == "h264"
    packets = packets_of(take_frames(camera, PICTURES))
    assert decoded_numbers(packets) == list(range(PICTURES)), "none is left out: they build on each other"
    options = {"input_format": "h264", "video_size": "1280x720", "framerate": "5"}
    assert opened == [{"path": node, "format": "v4l2", "options": options}]


@pytest.mark.parametrize("asked", [{}, {"passthrough": "device", "rotation": 90}, {"passthrough": "never"}])
def test_a_cameras_own_encoder_is_left_alone_unless_asked_for(
    encoding_camera: tuple[str, list[dict[str, Any]]], asked: dict[str, Any]
) -> None:
    node, opened = encoding_camera
    camera = build(CameraConfigurer, params={"source": node, **asked})
    with pytest.raises(SourceError, match="does not open as a camera"):  # what OpenCV says of an empty file
        take_frames(camera, 1)
    assert opened == []


def test_a_camera_without_an_encoder_is_read_as_before(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    node = tmp_path / "video8"
    node.touch()
    for module in ("source", "camera"):
        monkeypatch.setattr(f"mosaic_camera.{module}.is_device", lambda source: source == str(node))
    camera = build(CameraConfigurer, params={"source": str(node), "passthrough": "device"})
    with pytest.raises(SourceError, match="does not open as a camera"):
        take_frames(camera, 1)
    assert "makes no H.264" in caplog.text
