"""Encodes pictures with one libav encoder, tuned for latency: one picture in, its packets out, nothing held back."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, Literal, cast

import av
import cv2
from av.codec.hwaccel import HWAccel
from av.video.codeccontext import VideoCodecContext
from av.video.frame import PictureType

from mosaic_core.adapters.video.picture import PixelArray, luma_samples, own_frame
from mosaic_core.adapters.video.picture_clock import VIDEO_TIME_BASE
from mosaic_core.machines.media.encoder_clock import EncoderClock
from mosaic_core.machines.media.scene_cuts import SceneCuts
from mosaic_core.machines.timing.pacing import PictureRate

CodecName = Literal["VP8", "H264"]
Follows = Literal["options", "times", "anew"]
_NEVER = 1_000_000
"""Pictures between key frames that nobody asked for: none. Whoever joins or loses one asks."""
_STEP_UP, _STEP_DOWN = 1.4, 0.9
"""An encoder that must be made anew for another bit rate begins with a key frame: only for a real difference."""
_STEP_INTERVAL_TICKS = 4 * 90_000
_FPS_STEP = 1.4
_HEADROOM = 3.0
"""Over the first bit rate that is aimed at, where an encoder follows by times: far enough for most of what comes."""


@dataclass(frozen=True, slots=True)
class EncoderKind:
    """An encoder of libav and how it is used. ``follows``: how it comes to another bit rate: while it runs by its
    ``options``, by the ``times`` of its pictures (:class:`EncoderClock`), or made ``anew``; ``counts_pictures``:
    divides it by the nominal rate of pictures, whatever their times are; ``device``: the kind of hardware into whose
    memory its pictures are brought, ``None`` for one that takes them from ours."""

    name: str
    codec: CodecName
    pix_fmt: str
    is_hardware: bool
    follows: Follows
    counts_pictures: bool
    device: str | None = None


@dataclass(frozen=True, slots=True)
class EncoderSettings:
    """The picture size and bit rate of one encoder. ``ceiling_bps`` is never exceeded for long; ``fps`` is a first
    guess."""

    width: int
    height: int
    fps: float
    bitrate_bps: int
    ceiling_bps: int
    preset: Literal["drive", "inspect"] = "drive"


class VideoEncoder:
    """Encodes pictures with libav, on one thread. Raises :class:`av.FFmpegError` if it can't be opened or breaks."""

    def __init__(self, kind: EncoderKind, settings: EncoderSettings) -> None:
        self.kind = kind
        self._settings = settings
        self._bitrate_bps = settings.bitrate_bps
        self._fps = settings.fps
        self._rate = PictureRate()
        self._stepped_at_pts: int | None = None
        self._cuts = SceneCuts()
        self._samples: PixelArray | None = None
        self._context = self._opened()

    def encode(self, picture: av.VideoFrame, *, pts: int, as_key: bool) -> list[av.Packet[Any]]:
        """Encode a prepared picture of the settings' size; its pixels are only read. ``pts`` rises with every call."""
        self._follow_rate_of_pictures(pts)
        as_key = self._is_cut(picture, pts) or as_key
        if as_key:
            self._forget_the_scene()
        frame = own_frame(picture)
        if self.kind.pix_fmt != "yuv420p":
            frame = frame.reformat(format=self.kind.pix_fmt)
        frame.pts, frame.time_base = self._encoders_time(pts), VIDEO_TIME_BASE
        frame.pict_type = PictureType.I if as_key else PictureType.NONE
        packets = self._context.encode(frame)
        for packet in packets:
            packet.time_base = VIDEO_TIME_BASE
            if self.kind.follows == "times":
                packet.pts = packet.dts = pts
        return packets

    def follow(self, bitrate_bps: int, pts: int) -> None:
        """Aim at another bit rate before the picture of ``pts``. Some encoders must be made anew for that and begin
        with a key frame; they do it only for a real difference."""
        bitrate_bps = min(bitrate_bps, self._settings.ceiling_bps)
        if bitrate_bps == self._bitrate_bps:
            return
        if self.kind.follows == "options":
            self._context.bit_rate = self._bitrate_bps = bitrate_bps
            return
        within_bps = self._clock.nearest_bps(bitrate_bps) if self.kind.follows == "times" else self._bitrate_bps
        if within_bps != bitrate_bps and self._is_worth_a_key_frame(bitrate_bps, pts):
            self._bitrate_bps = bitrate_bps
            self._stepped_at_pts = pts
            self._reopen()
        else:
            self._clock.bitrate_bps = self._bitrate_bps = within_bps

    def _follow_rate_of_pictures(self, pts: int) -> None:
        """A source of 10 pictures per second, taken for one of 30, would be given a third of its bits."""
        self._rate.seen(pts / 90_000)
        fps = self._rate.fps
        if self.kind.counts_pictures and fps is not None and not 1 / _FPS_STEP < fps / self._fps < _FPS_STEP:
            self._fps = fps
            self._reopen()

    def _encoders_time(self, pts: int) -> int:
        if self.kind.follows != "times":
            return pts
        return self._clock.at(pts, None if self._rate.fps is None else 90_000 / self._rate.fps)

    def _is_cut(self, picture: av.VideoFrame, pts: int) -> bool:
        """Encoders that follow by options bound every picture, new scene or not."""
        if self.kind.follows == "options":
            return False
        before, self._samples = self._samples, luma_samples(picture)
        return before is not None and self._cuts.seen(float(cv2.absdiff(before, self._samples).mean()), pts / 90_000)

    def _forget_the_scene(self) -> None:
        """What libvpx has learnt makes the picture after a key frame as large as that one, or twice as large in a new
        scene. Hardware takes too long to be opened."""
        if self.kind.follows == "times" and self._clock.has_begun:
            self._reopen()

    def _is_worth_a_key_frame(self, bitrate_bps: int, pts: int) -> bool:
        if bitrate_bps < self._bitrate_bps * _STEP_DOWN:
            return True  # it is more than the link takes: at once
        if self._stepped_at_pts is None:
            self._stepped_at_pts = pts
        is_soon = pts - self._stepped_at_pts < _STEP_INTERVAL_TICKS
        is_top = bitrate_bps == self._settings.ceiling_bps
        return not is_soon and (is_top or bitrate_bps > self._bitrate_bps * _STEP_UP)

    def _reopen(self) -> None:
        """Give back the memory of the encoder before the new one takes its own: 10 MB of libvpx at 640 x 480."""
        del self._context
        self._context = self._opened()

    def _opened(self) -> VideoCodecContext:
        settings = self._settings
        memory = HWAccel(self.kind.device) if self.kind.device is not None else None
        context = cast(VideoCodecContext, av.CodecContext.create(self.kind.name, "w", hwaccel=memory))
        context.width, context.height = settings.width, settings.height
        context.pix_fmt = self.kind.pix_fmt
        context.time_base = VIDEO_TIME_BASE
        context.framerate = Fraction(self._fps).limit_denominator(1000)
        opened_bps = self._opening_bps()
        self._clock = EncoderClock(opened_bps)
        self._clock.bitrate_bps = self._bitrate_bps
        context.bit_rate = opened_bps
        context.gop_size = _NEVER
        context.max_b_frames = 0
        context.thread_count = _threads(settings.width * settings.height)
        context.options = dict(encoder_options(self.kind, settings.preset, opened_bps))
        context.open()
        context.bit_rate = self._bitrate_bps
        return context

    def _opening_bps(self) -> int:
        match self.kind.follows:
            case "options":
                # x264 follows another bit rate only if it began at a constant one, and never beyond: begin at the top.
                return self._settings.ceiling_bps
            case "times":
                return min(self._settings.ceiling_bps, round(_HEADROOM * self._bitrate_bps))
            case "anew":
                return self._bitrate_bps


def _threads(pixels: int) -> int:
    """One: more cost time to hand over and gain nothing up to 720p, where one thread needs 5 ms for a picture."""
    return 1 if pixels <= 1280 * 720 else 2


def encoder_options(kind: EncoderKind, preset: str, ceiling_bps: int) -> Mapping[str, str]:
    """The options of libav for least latency: no look-ahead, no reordering, and small key frames: what is larger than
    the link takes in a picture's time arrives late. A small rate buffer caps them, but for libvpx, which has a cap."""
    drives = preset == "drive"
    buffer_bits = ceiling_bps // 5 if drives else ceiling_bps // 2
    rate = {"maxrate": str(ceiling_bps), "bufsize": str(buffer_bits)}
    match kind.name:
        case "libx264":
            # superfast: at 0.8 Mbit/s and 720p, ultrafast is 14 dB worse and saves 1.2 ms of 4.4.
            speed = "superfast" if drives else "veryfast"
            return {**rate, "preset": speed, "tune": "zerolatency", "forced-idr": "1", "x264-params": "scenecut=0"}
        case "libvpx":
            # A negative speed is a fixed one; a positive one is a maximum of CPU, and twice as slow here.
            speed = "-6" if drives else "-5"
            return {
                **rate,
                "minrate": str(ceiling_bps),
                # Of a shorter buffer it spends all on one picture of noise, and nothing on the next four.
                "bufsize": str(ceiling_bps),
                "deadline": "realtime",
                "cpu-used": speed,
                "lag-in-frames": "0",
                "undershoot-pct": "100",
                "overshoot-pct": "15",
                "max-intra-rate": "300" if drives else "600",  # percent of a picture's share of the bit rate
                "static-thresh": "1",
                # A picture polished beyond what anybody sees (43 dB) makes the next movement three times as large.
                "qmin": "12" if drives else "4",
            }
        case "h264_nvenc":
            return {**rate, "preset": "p2", "tune": "ull", "rc": "cbr", "zerolatency": "1", "delay": "0",
                    "forced-idr": "1"}  # fmt: skip
        case "h264_qsv":
            return {**rate, "preset": "veryfast", "async_depth": "1", "low_delay_brc": "1", "forced_idr": "1"}
        case "h264_amf":
            return {**rate, "usage": "ultralowlatency", "rc": "cbr"}
        case "h264_vaapi" | "vp8_vaapi":
            return {**rate, "async_depth": "1"}  # two by default: one picture is held back
        case _:
            return rate
