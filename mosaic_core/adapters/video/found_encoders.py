"""Which encoders this process uses: found once, when the first camera is added, and told in one line of the log."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Mapping
from functools import partial

from mosaic_core.adapters.video.encoder_choice import EncoderUnavailable, chosen_kind, presumed
from mosaic_core.adapters.video.video_encoder import CodecName, EncoderKind

_log = logging.getLogger(__name__)

_CODECS: tuple[CodecName, ...] = ("H264", "VP8")
_AT_WORK = partial(chosen_kind, look=presumed)


def preferred_of(found: Mapping[CodecName, EncoderKind]) -> CodecName:
    """H.264 where only that is encoded in hardware; else VP8, which at equal CPU time has the better pictures
    (docs/topics/video.md)."""
    in_hardware = [codec for codec in _CODECS if codec in found and found[codec].is_hardware]
    return "H264" if in_hardware == ["H264"] else "VP8"


class FoundEncoders:
    """Finds this process's encoders and remembers them. Any thread, and nothing here waits: ``choose``, which takes its
    time, is called on a thread of its own.
    """

    def __init__(self, choose: Callable[[CodecName], EncoderKind] = _AT_WORK) -> None:
        self._choose = choose
        self._lock = threading.Lock()
        self._is_sought = False
        self._found: Mapping[CodecName, EncoderKind] | None = None
        self._told: set[EncoderKind] = set()

    def seek(self) -> None:
        """Find them in the background, before the first picture has to wait for that; once, however often called."""
        with self._lock:
            if self._is_sought:
                return
            self._is_sought = True
        threading.Thread(target=self._seek, name="probe encoders").start()  # a process ends after it, not within

    @property
    def preferred_codec(self) -> CodecName:
        """As :func:`preferred_of` says; VP8 during the moment in which they are still sought."""
        return preferred_of(self._found or {})

    def began(self, kind: EncoderKind) -> None:
        """An encoder runs: a line, unless it was told already, or is about to be."""
        with self._lock:
            is_new = kind not in self._told
            self._told.add(kind)
            if is_new and not (self._is_sought and self._found is None):
                _log.info("%s is encoded by %s", kind.codec, _shown(kind))

    def _seek(self) -> None:
        found: dict[CodecName, EncoderKind] = {}
        for codec in _CODECS:
            try:
                found[codec] = self._choose(codec)
            except EncoderUnavailable as error:
                _log.error("%s", error)
        with self._lock:
            self._found = found
            kinds = sorted(found.values(), key=lambda kind: kind.codec != self.preferred_codec)
            if kinds:
                chosen = " and ".join(f"{kind.codec} by {_shown(kind)}" for kind in kinds)
                _log.info("pictures are encoded as %s (`mosaic doctor encoders` shows all)", chosen)
            for kind in self._told - set(kinds):
                _log.info("%s is encoded by %s", kind.codec, _shown(kind))
            self._told.update(kinds)


def _shown(kind: EncoderKind) -> str:
    return f"{kind.name} in {'hardware' if kind.is_hardware else 'software'}"


ENCODERS = FoundEncoders()
"""Of this process: what works is a property of the machine."""
