"""Finds the encoders that work here, by opening each and encoding a few pictures: what libav lists says nothing about
drivers, devices and permissions.
"""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cache

import av
import numpy as np

from mosaic_core.adapters.video.picture import prepared_picture
from mosaic_core.adapters.video.video_encoder import CodecName, EncoderKind, EncoderSettings, VideoEncoder
from mosaic_core.words.errors import MosaicError

_log = logging.getLogger(__name__)


def _hardware(name: str, codec: CodecName, pix_fmt: str, device: str | None = None) -> EncoderKind:
    return EncoderKind(name, codec, pix_fmt, is_hardware=True, follows="anew", counts_pictures=True, device=device)


KINDS = (
    _hardware("h264_nvenc", "H264", "yuv420p"),
    _hardware("h264_qsv", "H264", "nv12"),
    _hardware("h264_vaapi", "H264", "nv12", device="vaapi"),
    _hardware("h264_v4l2m2m", "H264", "yuv420p"),
    _hardware("h264_amf", "H264", "nv12"),
    EncoderKind("libx264", "H264", "yuv420p", is_hardware=False, follows="options", counts_pictures=True),
    _hardware("vp8_vaapi", "VP8", "nv12", device="vaapi"),
    _hardware("vp8_v4l2m2m", "VP8", "yuv420p"),
    EncoderKind("libvpx", "VP8", "yuv420p", is_hardware=False, follows="times", counts_pictures=False),
)
"""In order of preference per codec: hardware first, software as the fallback that is always there."""

_PROBE = EncoderSettings(width=640, height=480, fps=30.0, bitrate_bps=1_000_000, ceiling_bps=1_000_000)
_PROBE_PICTURES = 5
_WARM_UP = 5
"""The first pictures are slower: a key frame, and memory touched for the first time."""
_NEEDS = {
    "h264_nvenc": "an NVIDIA GPU and its driver (libcuda, libnvidia-encode)",
    "h264_qsv": "an Intel GPU and its oneVPL runtime",
    "h264_amf": "an AMD GPU and its AMF runtime",
    "h264_vaapi": "a GPU with a VA-API driver, and /dev/dri/renderD128 that this account may open",
    "vp8_vaapi": "a GPU with a VA-API driver, and /dev/dri/renderD128 that this account may open",
    "h264_v4l2m2m": "a V4L2 encoder under /dev/video* that this account may open",
    "vp8_v4l2m2m": "a V4L2 encoder under /dev/video* that this account may open",
}
_NOT_BUILT = "not in this build of PyAV"
_probe_lock = threading.Lock()


class EncoderUnavailable(MosaicError):
    """An encoder that is wanted is not on this machine."""


@dataclass(frozen=True, slots=True)
class Probe:
    """Whether an encoder works here, and if not, why."""

    kind: EncoderKind
    problem: str = ""

    @property
    def works(self) -> bool:
        return not self.problem


def probed(kind: EncoderKind) -> Probe:
    """Open ``kind`` and encode with it, once per process. Takes milliseconds; any thread but the event loop's."""
    with _probe_lock:
        return _probed(kind)


@cache
def _probed(kind: EncoderKind) -> Probe:
    if kind.name not in av.codecs_available:
        return Probe(kind, _NOT_BUILT)
    try:
        encoder = VideoEncoder(kind, _PROBE)
        pictures = [_test_picture(step, _PROBE.width, _PROBE.height) for step in range(_PROBE_PICTURES)]
        made = [encoder.encode(picture, pts=picture.pts or 0, as_key=False) for picture in pictures]
    except (av.FFmpegError, ValueError, MemoryError, NotImplementedError) as error:
        return Probe(kind, _cause(kind, error))
    if sum(map(len, made)) < _PROBE_PICTURES - 1:
        return Probe(kind, "it holds pictures back: too late for driving")
    return Probe(kind)


def presumed(kind: EncoderKind) -> Probe:
    """The probe of a robot at work: of an encoder in software only whether libav has it. It needs no device that could
    be missing, and one that was open for a moment leaves its megabytes in the process."""
    if kind.is_hardware:
        return probed(kind)
    return Probe(kind, "" if kind.name in av.codecs_available else _NOT_BUILT)


def chosen_kind(
    codec: CodecName,
    wanted: str = "auto",
    *,
    broken: Iterable[str] = (),
    look: Callable[[EncoderKind], Probe] = probed,
) -> EncoderKind:
    """The encoder for ``codec``: the ``wanted`` one if it makes this codec, else the first that works, as ``look``
    finds.

    Raises :class:`EncoderUnavailable`. May take a moment the first time: not on the event loop.
    """
    kinds = [kind for kind in KINDS if kind.codec == codec and kind.name not in set(broken)]
    forced = [kind for kind in kinds if kind.name == wanted]
    for kind in (*forced, *kinds):
        probe = look(kind)
        if probe.works:
            return kind
        if kind.name == wanted:
            _warn_of_forced(wanted, probe.problem)
    raise EncoderUnavailable(
        f"no encoder for {codec} works here; see `mosaic doctor encoders`", code="media.no_encoder"
    )


@cache
def _warn_of_forced(wanted: str, problem: str) -> None:
    _log.warning("encoder %s does not work here: %s; another one is used", wanted, problem)


@dataclass(frozen=True, slots=True)
class EncoderSpeed:
    """Pictures per second that one core's worth of calls gives, and milliseconds from a picture to its packet: the
    median, and what nine of ten stay below."""

    fps: float
    median_ms: float
    slow_ms: float


def measured_speed(kind: EncoderKind, width: int = 1280, height: int = 720, pictures: int = 60) -> EncoderSpeed:
    """How fast a working encoder is at this size. Blocks, for seconds if it is slow."""
    encoder = VideoEncoder(kind, EncoderSettings(width, height, 30.0, 2_000_000, 2_500_000))
    frames = [_test_picture(step, width, height) for step in range(pictures)]
    took_s = []
    for frame in frames:
        began_s = time.perf_counter()
        encoder.encode(frame, pts=frame.pts or 0, as_key=False)
        took_s.append(time.perf_counter() - began_s)
    settled = sorted(took_s[_WARM_UP:])
    median_s, slow_s = settled[len(settled) // 2], settled[len(settled) * 9 // 10]
    return EncoderSpeed(len(settled) / sum(settled), median_s * 1000, slow_s * 1000)


def _test_picture(step: int, width: int, height: int) -> av.VideoFrame:
    """Texture that moves: an encoder is never as fast as on an empty picture."""
    rows = np.arange(height, dtype=np.uint32)[:, None]
    columns = np.arange(width, dtype=np.uint32)[None, :] + 4 * step
    texture = ((rows * 7 + columns * 13 + (rows * columns >> 6)) & 0xFF).astype(np.uint8)
    return prepared_picture(texture, step / 30)


def _cause(kind: EncoderKind, error: Exception) -> str:
    text = str(getattr(error, "strerror", "") or error or type(error).__name__)
    return f"it needs {_NEEDS[kind.name]} ({text})" if kind.name in _NEEDS else text
