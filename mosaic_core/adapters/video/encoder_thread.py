"""Runs one rung's encoder on a thread of its own: takes the newest picture, leaves out what it has no time for.

libav releases the GIL while it encodes, so neither the event loop nor the handler waits for it.
"""

from __future__ import annotations

import logging
import threading
import time
from dataclasses import dataclass
from typing import Any, Protocol

import av

from mosaic_core.adapters.video.encoder_choice import EncoderUnavailable, chosen_kind, presumed
from mosaic_core.adapters.video.found_encoders import ENCODERS
from mosaic_core.adapters.video.picture import scaled_picture
from mosaic_core.adapters.video.video_encoder import CodecName, EncoderSettings, VideoEncoder
from mosaic_core.machines.media.key_frame_requests import KeyFrameRequests
from mosaic_core.machines.media.rung_ladder import Rung

_log = logging.getLogger(__name__)

_IDLE_S = 0.15
"""A viewer who waits for a key frame of a slow source gets the last picture again after this."""


@dataclass(frozen=True, slots=True)
class EncodedRung:
    """A rung in one codec: the key of an encoder and of the packets that it makes."""

    codec: CodecName
    rung: Rung


@dataclass(frozen=True, slots=True)
class EncoderOrder:
    """An order to encode the pictures of ``label``, by a named encoder or by the best that works (``auto``)."""

    label: str
    key: EncodedRung
    settings: EncoderSettings
    encoder: str = "auto"


class EncoderListener(Protocol):
    """Hears what encoders make, from each on its own thread."""

    def encoded(self, key: EncodedRung, packet: av.Packet[Any]) -> None: ...
    def failed(self, key: EncodedRung, error: EncoderUnavailable) -> None:
        """No encoder for this rung works; told once, at the end."""


class EncoderThread:
    """Encodes one rung on its own thread. ``offer``, ``ask_key_frame`` and ``aim_at`` on any, none of them blocks."""

    def __init__(self, order: EncoderOrder, listener: EncoderListener) -> None:
        self._order = order
        self._listener = listener
        self._changed = threading.Condition()
        self._waiting: av.VideoFrame | None = None
        self._last: av.VideoFrame | None = None
        self._bitrate_bps = order.settings.bitrate_bps
        self._requests = KeyFrameRequests()
        self._is_closed = False
        self._offered = 0
        self._last_pts = -1
        self.skipped = 0
        self.encoded = 0
        self.cpu_s = 0.0
        """CPU time that its thread has used."""
        self._thread = threading.Thread(target=self._run, name=f"encode {order.label}", daemon=True)
        self._thread.start()

    def offer(self, picture: av.VideoFrame) -> None:
        """A prepared picture of any size; replaces one that still waits."""
        with self._changed:
            self._offered += 1
            if (self._offered - 1) % self._order.key.rung.frame_step:
                return
            if self._waiting is not None:
                self.skipped += 1
            self._waiting = picture
            self._changed.notify()

    def ask_key_frame(self) -> None:
        with self._changed:
            self._requests.ask()
            self._changed.notify()

    def aim_at(self, bitrate_bps: int) -> None:
        self._bitrate_bps = bitrate_bps

    def close(self) -> None:
        """Begin to end; a picture that is being encoded is the last one."""
        with self._changed:
            self._is_closed = True
            self._changed.notify()

    def join(self, timeout_s: float) -> None:
        self._thread.join(timeout_s)

    # -- the encoder's thread ------------------------------------------------------------------------------------

    def _run(self) -> None:
        broken: list[str] = []
        while True:
            try:
                kind = chosen_kind(self._order.key.codec, self._order.encoder, broken=broken, look=presumed)
            except EncoderUnavailable as error:
                self._listener.failed(self._order.key, error)
                return
            ENCODERS.began(kind)
            try:
                self._encode_all(VideoEncoder(kind, self._order.settings))
                return
            except Exception as error:  # noqa: BLE001 - drivers raise anything; viewers must not wait for ever
                _log.warning("%s: encoder %s failed (%s); trying another one", self._order.label, kind.name, error)
                broken.append(kind.name)

    def _encode_all(self, encoder: VideoEncoder) -> None:
        while (picture := self._next()) is not None:
            now_s = time.monotonic()
            with self._changed:
                was_asked = self._requests.take(now_s)
                self._last_pts = max(picture.pts or 0, self._last_pts + 1)
            settings = self._order.settings
            sized = scaled_picture(picture, settings.width, settings.height)
            encoder.follow(self._bitrate_bps, self._last_pts)
            packets = encoder.encode(sized, pts=self._last_pts, as_key=was_asked)
            if not was_asked and any(packet.is_keyframe for packet in packets):
                with self._changed:
                    self._requests.made(now_s)
            for packet in packets:
                self._listener.encoded(self._order.key, packet)
            self.encoded += 1
            self.cpu_s = time.thread_time()

    def _next(self) -> av.VideoFrame | None:
        """The newest picture; the last one again if somebody waits for a key frame and the source is slow."""
        with self._changed:
            while not self._is_closed:
                if self._waiting is not None:
                    self._last, self._waiting = self._waiting, None
                    return self._last
                wait_s = self._repeat_in_s()
                if not self._changed.wait(wait_s) and wait_s is not None and self._waiting is None:
                    return self._last
            return None

    def _repeat_in_s(self) -> float | None:
        if self._last is None or not self._requests.is_pending:
            return None
        return max(_IDLE_S, self._requests.wait_s(time.monotonic()))
