"""Video: what viewers cost, how pictures reach the encoder, and what codecs give for their CPU time.

python bench/video.py [ROUNDS] [--height 480]

Ways alternate within each round; figures are medians of the rounds, and the ratios are what counts. Robot and operators
are processes of their own; operators count pictures instead of decoding them. GStreamer's webrtcbin is measured beside
the others only where its Python binding is installed.
"""

from __future__ import annotations

import argparse
import statistics
from collections import defaultdict
from importlib.util import find_spec

from rich.console import Console
from rich.table import Table
from video_bench import codecs, numpy_path
from video_bench.fan_out import Spent, spent
from video_bench.scene import scene

VIEWERS = (1, 2, 4, 10)
SIZES = {480: (640, 480), 720: (1280, 720)}
WAYS = (("ours", "vp8"), ("ours", "h264"), ("aiortc", "vp8"), ("aiortc", "h264"))
CODEC_RATES_BPS = (800_000, 2_500_000)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("rounds", nargs="?", type=int, default=3)
    parser.add_argument("--height", type=int, choices=tuple(SIZES), default=480)
    wanted = parser.parse_args()
    console = Console(width=110)
    fan_out(console, wanted.rounds, SIZES[wanted.height])
    conversion(console, wanted.rounds)
    codec_figures(console)


def fan_out(console: Console, rounds: int, size: tuple[int, int]) -> None:
    """Viewers: 1, 2, 4, 10; our shared encoder beside aiortc's per peer."""
    found: dict[tuple[str, str, int], list[Spent]] = defaultdict(list)
    for _ in range(rounds):
        for viewers in VIEWERS:
            for way, codec in WAYS:
                found[way, codec, viewers].append(spent(way, codec, size, viewers))  # type: ignore[arg-type]
    table = Table(title=f"CPU of the robot's process, {size[0]}x{size[1]} at 30 per second, % of one core")
    for name in ("way", "viewers", "encoder", "x one viewer", "whole process", "fps per viewer"):
        table.add_column(name, justify="left" if name == "way" else "right")
    for way, codec in WAYS:
        for viewers in VIEWERS:
            runs = found[way, codec, viewers]
            encoder, process = _median(runs, "encoder"), _median(runs, "process")
            one = _median(found[way, codec, 1], "encoder")
            row = (f"{encoder:.0%}", f"{encoder / one:.2f}", f"{process:.0%}", f"{_median(runs, 'fps_per_viewer'):.1f}")
            table.add_row(f"{way} {codec}", str(viewers), *row)
    console.print(table)
    console.print("aiortc's H.264 encodes on threads of x264: they are in the whole process only")
    if find_spec("gi") is None:
        console.print("GStreamer webrtcbin: skipped, its Python binding is not installed here\n")


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
