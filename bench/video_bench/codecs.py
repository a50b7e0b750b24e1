"""What a codec gives for its CPU time, at the same bit rate and size: also those that aiortc can't send."""

from __future__ import annotations

import os
import time
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, cast

import av
import numpy as np

from mosaic_core.adapters.video.encoder_choice import KINDS
from mosaic_core.adapters.video.picture import own_frame, prepared_picture
from mosaic_core.adapters.video.video_encoder import encoder_options
from video_bench.scene import Image

FPS = 30
os.environ.setdefault("SVT_LOG", "0")
"""It speaks to the terminal of whoever uses it."""


@dataclass(frozen=True, slots=True)
class Figure:
    """CPU time of all threads, per picture."""

    encode_ms: float
    decode_ms: float
    psnr_db: float
    bitrate_bps: float


def candidates(bitrate_bps: int) -> dict[str, tuple[str, str, dict[str, str]]]:
    """Name → (encoder, decoder, options)."""
    ours = {kind.name: dict(encoder_options(kind, "drive", bitrate_bps)) for kind in KINDS if not kind.is_hardware}
    rate = {"minrate": str(bitrate_bps), "maxrate": str(bitrate_bps), "bufsize": str(bitrate_bps // 4)}
    kilobits = bitrate_bps // 1000
    return {
        "VP8 (drive)": ("libvpx", "vp8", ours["libvpx"]),
        "H.264 superfast (drive)": ("libx264", "h264", ours["libx264"]),
        "H.264 ultrafast": ("libx264", "h264", {**ours["libx264"], "preset": "ultrafast"}),
        "H.264 veryfast (inspect)": ("libx264", "h264", {**ours["libx264"], "preset": "veryfast"}),
        "VP9": ("libvpx-vp9", "vp9", {**rate, "deadline": "realtime", "cpu-used": "8", "lag-in-frames": "0"}),
        "AV1 (SVT, 12)": (
            "libsvtav1",
            "libdav1d",
            {"preset": "12", "svtav1-params": f"rc=2:pred-struct=1:tbr={kilobits}"},
        ),
    }


def measured(encoder: str, decoder: str, options: dict[str, str], pictures: list[Image], bitrate_bps: int) -> Figure:
    """Encode and decode all pictures, on one thread where the codec lets itself be told so."""
    height, width = pictures[0].shape[:2]
    coder, reader = cast(Any, av.CodecContext.create(encoder, "w")), cast(Any, av.CodecContext.create(decoder, "r"))
    coder.width, coder.height, coder.pix_fmt, coder.bit_rate = width, height, "yuv420p", bitrate_bps
    coder.time_base, coder.framerate, coder.gop_size = Fraction(1, 90_000), Fraction(FPS), 3000
    coder.options, coder.thread_count, reader.thread_count = options, 1, 1
    took_s, read_s, psnr_db, size_bytes = [], [], [], 0
    for number, image in enumerate(pictures):
        frame = own_frame(prepared_picture(image, 1 + number / FPS))
        luma = frame.to_ndarray()[:height].astype(int)
        began_s = time.process_time()
        packets = coder.encode(frame)
        took_s.append(time.process_time() - began_s)
        for packet in packets:
            size_bytes += packet.size
            began_s = time.process_time()
            shown = reader.decode(packet)
            read_s.append(time.process_time() - began_s)
            for one in shown:
                error = ((one.to_ndarray()[:height].astype(int) - luma) ** 2).mean()
                psnr_db.append(10 * np.log10(255**2 / max(error, 1e-9)))
    coder.encode(None)
    seconds = len(pictures) / FPS
    return Figure(
        sum(took_s) / len(took_s) * 1000,
        sum(read_s) / len(read_s) * 1000,
        float(np.mean(psnr_db[FPS:])),
        size_bytes * 8 / seconds,
    )
