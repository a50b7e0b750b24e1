"""Shares one camera among all its viewers: converted once, encoded once per codec and rung that somebody watches, and
sent to each viewer from a key frame on, on the best rung that its link takes.
"""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Callable, Hashable
from dataclasses import replace
from typing import Any

import av

from mosaic_core.adapters.video.encoder_choice import EncoderUnavailable
from mosaic_core.adapters.video.encoder_set import EncoderSet
from mosaic_core.adapters.video.encoder_thread import EncodedRung
from mosaic_core.adapters.video.found_encoders import ENCODERS
from mosaic_core.adapters.video.packet_source import PassedPackets, SourceState
from mosaic_core.adapters.video.picture import prepared_picture
from mosaic_core.adapters.video.picture_clock import stamped
from mosaic_core.adapters.video.rung_orders import PASSED_ON, SourceShape, codecs_of, limits_bps, options_of, orders_of
from mosaic_core.adapters.video.video_encoder import CodecName
from mosaic_core.adapters.video.viewer_feed import ViewerFeed
from mosaic_core.contract.media import Captured, EncodingParams, PacketCodec
from mosaic_core.machines.timing.pacing import PictureRate
from mosaic_core.runtime.observation.counters import ConnectorCounters
from mosaic_core.runtime.threads.handover import Handover
from mosaic_core.runtime.timing.deadline_timer import DeadlineTimer
from mosaic_core.runtime.transport.media_transport import TellUnavailable

_log = logging.getLogger(__name__)

TICK_S = 0.5
_MAX_HANDED_OVER = 64
"""Packets on their way to the event loop; if it is further behind, everybody goes on at the next key frame."""
_MIME_TYPES: dict[CodecName, str] = {"VP8": "video/VP8", "H264": "video/H264"}


class SharedVideo:
    """Encodes one camera's pictures once for all viewers; a ``runtime.transport.PictureStream``."""

    def __init__(
        self,
        label: str,
        encoding: EncodingParams,
        counters: ConnectorCounters,
        packet_codec: PacketCodec | None = None,
    ) -> None:
        ENCODERS.seek()
        self._label = label
        self._encoding = encoding
        self._counters = counters
        self._handover: Handover[Callable[[], None]] = Handover(
            asyncio.get_running_loop(), lambda act: act(), _MAX_HANDED_OVER
        )
        self._viewers: dict[str, ViewerFeed] = {}
        self._watching: dict[str, ViewerFeed] = {}  # replaced, never changed: the handler's thread reads it
        self._shape = SourceShape()
        self._rate = PictureRate()
        self._packet_codec = packet_codec
        self._packets = PassedPackets(label, packet_codec or "h264", encoding.max_bitrate_bps)
        self._needs_pictures = True
        self._has_overflowed = False
        self._counted: Hashable = None
        self._timer = DeadlineTimer(self._tick)
        self._is_ticking = False
        self.encoders = EncoderSet(self)
        self._offered_size: tuple[int, int] | None = None
        self._offered_state: SourceState | None = None

    # -- on the handler's thread ---------------------------------------------------------------------------------

    def offer(self, captured: Captured) -> bool:
        """See ``PictureStream``. Raises :class:`TypeError` for what is no picture."""
        if not self._watching:
            return False
        if isinstance(captured.image, av.Packet):
            self._offer_packet(captured.image, captured.captured_at_s)
        else:
            picture = prepared_picture(captured.image, captured.captured_at_s)
            self._tell_state(None)
            self._offer_picture(picture)
        return not self._has_overflowed

    def _offer_picture(self, picture: av.VideoFrame) -> None:
        self._rate.seen((picture.pts or 0) / 90_000)
        self.encoders.offer(picture)
        size = (picture.width, picture.height)
        if size != self._offered_size and self._to_loop(lambda: self._reshape(replace(self._shape, size=size))):
            self._offered_size = size

    def _offer_packet(self, packet: av.Packet[Any], captured_at_s: float) -> None:
        if not packet.size:
            return  # a demuxer's sign that the recording is over
        packet = self._packets.taken(stamped(packet, captured_at_s))
        if self._needs_pictures:
            for picture in self._packets.pictures(packet):
                self._offer_picture(picture)
        else:
            self._packets.rest()
        self._tell_state(self._packets.state)
        if self._packets.state.sendable_as is not None:
            self._to_loop(lambda: self._distribute(PASSED_ON, packet))

    def _tell_state(self, state: SourceState | None) -> None:
        if state != self._offered_state and self._to_loop(lambda: self._reshape(replace(self._shape, packets=state))):
            self._offered_state = state

    # -- on the encoders' threads --------------------------------------------------------------------------------

    def encoded(self, key: EncodedRung, packet: av.Packet[Any]) -> None:
        self._to_loop(lambda: self._distribute(key, packet))

    def failed(self, key: EncodedRung, error: EncoderUnavailable) -> None:
        self._to_loop(lambda: self._tell_failed(key, error))

    def _to_loop(self, act: Callable[[], None]) -> bool:
        is_taken = self._handover.put(act)
        self._has_overflowed |= not is_taken
        return is_taken

    # -- on the event loop ---------------------------------------------------------------------------------------

    def bind(self, viewer_id: str, unavailable: TellUnavailable, *, is_local: bool = False) -> ViewerFeed:
        if viewer_id not in self._viewers:
            codecs = codecs_of(self._shape, self._encoding, self._packet_codec, ENCODERS.preferred_codec)
            order = [_MIME_TYPES[codec] for codec in codecs]
            self._viewers[viewer_id] = ViewerFeed(order, unavailable, self._wants_key, self._reconsider, is_local)
        return self._viewers[viewer_id]

    def watch(self, viewer_id: str, on: bool) -> None:
        viewer = self._viewers.get(viewer_id)
        if viewer is None or on == viewer.is_watching:
            return
        if on:
            self._begin(viewer)
            self._watching = {**self._watching, viewer_id: viewer}
        else:
            viewer.pause()
            self._watching = {name: other for name, other in self._watching.items() if other is not viewer}
        self._reconsider()
        if not self._is_ticking:
            self._tick()

    def leave(self, viewer_id: str) -> None:
        self.watch(viewer_id, False)
        self._viewers.pop(viewer_id, None)

    def close(self) -> None:
        for viewer_id in tuple(self._watching):
            self.watch(viewer_id, False)
        self._timer.cancel()
        self._is_ticking = False
        self.encoders.close()

    def _begin(self, viewer: ViewerFeed) -> None:
        options = options_of(viewer.codec, self._shape, self._encoding, is_local=viewer.is_local)
        least_bps, most_bps = limits_bps(self._shape, self._encoding, is_local=viewer.is_local)
        limits = (most_bps if viewer.is_local else least_bps, most_bps)
        viewer.begin(options, limits, time.monotonic(), self._encoding.max_bitrate_bps)

    def _tick(self) -> None:
        self._counters.dropped += self.encoders.take_skipped()
        self._is_ticking = bool(self._watching)
        if not self._is_ticking:
            return
        now_s = time.monotonic()
        for viewer in self._watching.values():
            viewer.connection.tick()
        self._reconsider()
        self._timer.set(now_s + TICK_S)

    # -- the source ----------------------------------------------------------------------------------------------

    def _reshape(self, shape: SourceShape) -> None:
        self._shape = shape
        for viewer in self._watching.values():
            self._begin(viewer)
        self._reconsider()

    # -- who gets what -------------------------------------------------------------------------------------------

    def _reconsider(self) -> None:
        """Each viewer on the rung that it affords; encoders for these rungs and no others."""
        now_s, joined = time.monotonic(), []
        for viewer in self._watching.values():
            target = viewer.target(now_s)
            if target != viewer.switch.wanted and target is not None:
                viewer.switch.want(target)
                joined.append(target)
            if target is None and self._shape.is_hopeless(viewer.codec):
                viewer.refuse("media.not_decodable")
        before = self.encoders.running
        orders = orders_of(self._label, self._watching.values(), self._encoding, self._rate.fps)
        self.encoders.use(orders, held=[key for key in orders if self._is_held(key)])
        for key in joined:
            if key in before:  # a new encoder begins with a key frame anyway
                self.encoders.ask_key_frame(key)
        self._needs_pictures = bool(orders) or any(viewer.switch.wanted is None for viewer in self._watching.values())
        self._counted = max(orders, key=lambda key: key.rung.ceiling_bps, default=PASSED_ON)

    def _is_held(self, key: EncodedRung) -> bool:
        """A queue drains on the way to each of its viewers. A picture that is not even encoded is missed by no later
        one: nobody needs a key frame afterwards."""
        viewers = [viewer for viewer in self._watching.values() if key in viewer.switch.used]
        return all(viewer.connection.is_paused for viewer in viewers)

    def _wants_key(self, viewer: ViewerFeed) -> None:
        self.encoders.ask_key_frame(viewer.switch.needs_key or viewer.switch.current)

    def _distribute(self, key: Hashable, packet: av.Packet[Any]) -> None:
        if self._has_overflowed:
            self._start_over()
        has_moved = False
        for viewer in self._watching.values():
            before = viewer.switch.current
            self._counters.dropped += viewer.offer(key, packet)
            has_moved |= viewer.switch.current != before
        if has_moved:
            self._reconsider()
        if key == self._counted:
            self._counters.count(packet.size, time.monotonic())

    def _start_over(self) -> None:
        """Packets were lost on the way to the loop."""
        self._has_overflowed = False
        for viewer in self._watching.values():
            viewer.switch.tear()
            self._wants_key(viewer)

    def _tell_failed(self, key: EncodedRung, error: EncoderUnavailable) -> None:
        _log.error("%s: %s", self._label, error)
        for viewer in self._watching.values():
            if viewer.switch.wanted == key:
                viewer.refuse(error.code)
