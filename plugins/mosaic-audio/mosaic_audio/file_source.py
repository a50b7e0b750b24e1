"""The sound of a file, decoded by PyAV into 20 ms pieces; the microphone paces them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import av
import numpy as np

from mosaic_core import DeviceGone
from mosaic_core.contract.sound import Samples

RATE_HZ = 48_000
PIECE = RATE_HZ // 50


class NoSoundFile(DeviceGone):
    """A file that can't be played."""

    def __init__(self, path: Path, why: str) -> None:
        cure = "set `source` to a file with sound, such as WAV, MP3, FLAC, Ogg or MP4"
        super().__init__(f"{path} can't be played: {why}", cure)


def file_sounds(path: Path, channels: int | None) -> Iterator[Samples]:
    """The file once, at 48 kHz. Raises :class:`NoSoundFile`."""
    if not path.is_file():
        raise NoSoundFile(path, "there is no such file")
    try:
        with av.open(path) as container:
            if not container.streams.audio:
                raise NoSoundFile(path, "it has no sound")
            stream = container.streams.audio[0]
            layout = "mono" if (channels or stream.codec_context.channels) == 1 else "stereo"
            resampler = av.AudioResampler(format="s16", layout=layout, rate=RATE_HZ, frame_size=PIECE)
            for frame in container.decode(stream):
                frame.pts = None
                for piece in resampler.resample(frame):
                    yield _samples(piece)
            for piece in resampler.resample(None):
                yield _samples(piece)
    except av.FFmpegError as error:
        raise NoSoundFile(path, str(error.strerror or error)) from error


def _samples(frame: av.AudioFrame) -> Samples:
    return np.ascontiguousarray(frame.to_ndarray().reshape(-1, frame.layout.nb_channels).astype(np.int16, copy=False))
