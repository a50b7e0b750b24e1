"""Video: what viewers cost, how pictures reach the encoder, and what codecs give for their CPU time.

python bench/video.py [ROUNDS] [--height 480] [--viewers 1 2 4 10] [--only viewers conversion codecs]

Ways alternate within each round; figures are medians of the rounds, and the ratios are what counts. Robot and operators
are processes of their own; operators count pictures instead of decoding them. GStreamer's webrtcbin is measured too
where it and its Python binding are installed.
"""

from __future__ import annotations

import argparse
import statistics
from collections import defaultdict
from collections.abc import Sequence

from rich.console import Console
from rich.table import Table
from video_bench import codecs, gstreamer, numpy_path
from video_bench.fan_out import Spent, Way, spent
from video_bench.scene import scene

VIEWERS = (1, 2, 4, 10)
SIZES = {480: (640, 480), 720: (1280, 720)}
WAYS: tuple[tuple[Way, str], ...] = (("ours", "vp8"), ("ours", "h264"), ("aiortc", "vp8"), ("aiortc", "h264"))
WAYS_OF_GSTREAMER: tuple[tuple[Way, str], ...] = (("webrtcbin", "vp8"), ("webrtcbin, one encoder", "vp8"))
PARTS = ("viewers", "conversion", "codecs")
CODEC_RATES_BPS = (800_000, 2_500_000)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("rounds", nargs="?", type=int, default=3)
    parser.add_argument("--height", type=int, choices=tuple(SIZES), default=480)
    parser.add_argument("--viewers", nargs="+", type=int, default=VIEWERS)
    parser.add_argument("--only", nargs="+", choices=PARTS, default=PARTS)
    wanted = parser.parse_args()
    console = Console(width=110)
    if "viewers" in wanted.only:
        fan_out(console, wanted.rounds, SIZES[wanted.height], wanted.viewers)
    if "conversion" in wanted.only:
        conversion(console, wanted.rounds)
    if "codecs" in wanted.only:
        codec_figures(console)


def fan_out(console: Console, rounds: int, size: tuple[int, int], audiences: Sequence[int]) -> None:
    """Our shared encoder beside aiortc's per peer and GStreamer's, for audiences of these sizes."""
    lacking = gstreamer.why_not()
    ways = WAYS if lacking else (*WAYS, *WAYS_OF_GSTREAMER)
    found: dict[tuple[str, str, int], list[Spent]] = defaultdict(list)
    for _ in range(rounds):
        for viewers in audiences:
            for way, codec in ways:
                found[way, codec, viewers].append(spent(way, codec, size, viewers))
    table = Table(title=f"CPU of the robot's process, {size[0]}x{size[1]} at 30 per second, % of one core")
    for name in ("way", "viewers", "encoder", "x fewest viewers", "whole process", "fps per viewer"):
        table.add_column(name, justify="left" if name == "way" else "right")
    for way, codec in ways:
        for viewers in audiences:
            runs = found[way, codec, viewers]
            encoder, process = _median(runs, "encoder"), _median(runs, "process")
            one = _median(found[way, codec, min(audiences)], "encoder")
            row = (f"{encoder:.0%}", f"{encoder / one:.2f}", f"{process:.0%}", f"{_median(runs, 'fps_per_viewer'):.1f}")
            table.add_row(f"{way} {codec}", str(viewers), *row)
    console.print(table)
    console.print("aiortc's H.264 encodes on threads of x264: they are in the whole process only")
    console.print(
        f"GStreamer webrtcbin: skipped, {lacking}\n"
        if lacking
        else "webrtcbin's encoder: the threads that convert, encode and pack; not what hands pictures over to them\n"
    )


def conversion(console: Console, rounds: int) -> None:
    table = Table(title="A numpy picture (BGR) to what an encoder takes, ms per picture")
    for name in ("size", "ours", "from_ndarray + reformat", "ratio"):
        table.add_column(name, justify="right")
    for width, height in SIZES.values():
        pictures = scene(width, height)
        ours, naive = [], []
        for _ in range(max(rounds, 5)):
            ours.append(numpy_path.ours_ms(pictures))
            naive.append(numpy_path.naive_ms(pictures))
        mine, other = statistics.median(ours), statistics.median(naive)
        table.add_row(f"{width}x{height}", f"{mine:.2f}", f"{other:.2f}", f"{other / mine:.1f}")
    console.print(table)


def codec_figures(console: Console) -> None:
    pictures = scene(*SIZES[720])
    for bitrate_bps in CODEC_RATES_BPS:
        table = Table(title=f"Codecs at 1280x720 and {bitrate_bps / 1e6:g} Mbit/s, ms of CPU per picture")
        for name in ("codec", "encode ms", "decode ms", "PSNR dB", "kbit/s"):
            table.add_column(name, justify="left" if name == "codec" else "right")
        for name, (encoder, decoder, options) in codecs.candidates(bitrate_bps).items():
            figure = codecs.measured(encoder, decoder, options, pictures, bitrate_bps)
            ms = (f"{figure.encode_ms:.1f}", f"{figure.decode_ms:.1f}")
            table.add_row(name, *ms, f"{figure.psnr_db:.1f}", f"{figure.bitrate_bps / 1000:.0f}")
        console.print(table)


def _median(runs: list[Spent], name: str) -> float:
    return float(statistics.median(getattr(run, name) for run in runs))


if __name__ == "__main__":
    main()
