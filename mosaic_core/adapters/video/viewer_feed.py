"""One viewer of one camera: which packets it is sent, and what its link takes."""

from __future__ import annotations

import asyncio
import math
import time
from collections import deque
from collections.abc import Callable, Hashable, Sequence
from typing import Any

import av

from mosaic_core.adapters.video.video_encoder import CodecName
from mosaic_core.machines.congestion.packet_copies import PacketCopies
from mosaic_core.machines.congestion.packet_pacer import PacketPacer
from mosaic_core.machines.congestion.path_rate import PathRate
from mosaic_core.machines.congestion.path_watch import PathSeen
from mosaic_core.machines.congestion.rate_control import Feedback, PictureLost, RateControl
from mosaic_core.machines.congestion.retransmissions import Retransmissions
from mosaic_core.machines.media.rung_choice import RungChoice
from mosaic_core.machines.media.rung_ladder import Rung
from mosaic_core.machines.media.rung_switch import RungSwitch
from mosaic_core.runtime.timing.deadline_timer import DeadlineTimer
from mosaic_core.runtime.transport.media_transport import TellUnavailable

MAX_WAITING = 8
"""Packets that wait for one viewer's transport: a quarter of a second, then it goes on at the next key frame."""
MAX_WAITING_LOCAL = 64
"""Packets that wait for a tap: nobody looks at them live, so that two seconds of a busy event loop may lose none."""
_PACKET_BYTES = 1200
_CODECS: dict[str, CodecName] = {"video/vp8": "VP8", "video/h264": "H264"}


class ViewerFeed:
    """One viewer's packets of one camera; a ``runtime.transport.PictureFeed``. Event loop only.

    ``wants_key`` is called when this viewer can't go on without a key frame, ``changed`` when its link did.
    """

    def __init__(
        self,
        codec_order: Sequence[str],
        unavailable: TellUnavailable,
        wants_key: Callable[[ViewerFeed], None],
        changed: Callable[[], None],
        is_local: bool = False,
    ) -> None:
        self.is_local = is_local
        self.codec_order = tuple(codec_order)
        self.codec: CodecName | None = None
        self.switch: RungSwitch[Hashable] = RungSwitch()
        self.rate: RateControl | PathRate | None = None
        self._choice: RungChoice | None = None
        self._keys: tuple[Hashable, ...] = ()
        self._unavailable = unavailable
        self._wants_key = wants_key
        self._changed = changed
        self._told: str | None = None
        self._repeats = Retransmissions()
        self._copies = PacketCopies()
        self._ceiling_bps: int | None = None
        self._pause = DeadlineTimer(self._go_on)
        self._is_paused = False
        self._pacer = PacketPacer()
        self._items: deque[av.Packet[Any]] = deque()
        self._arrived = asyncio.Event()

    # -- what its track calls ------------------------------------------------------------------------------------

    def codec_agreed(self, mime_type: str) -> None:
        self.codec = _CODECS[mime_type.lower()]

    async def next(self) -> av.Packet[Any]:
        while not self._items:
            self._arrived.clear()
            await self._arrived.wait()
        packet = self._items.popleft()
        if self.rate is not None:
            self.rate.sent(packet.size, time.monotonic(), is_key=packet.is_keyframe)
        return packet

    def heard(self, feedback: Feedback) -> None:
        if self.rate is None:
            return
        now_s = time.monotonic()
        if isinstance(feedback, PathSeen):
            self._hear_path(feedback, self.rate, now_s)
        else:
            self.rate.handle(feedback, now_s)
        if isinstance(feedback, PictureLost):
            self._wants_key(self)
        if not self._is_paused:
            self._changed()

    def repeats(self, sequence_number: int) -> int:
        if self.rate is None:
            return 0
        now_s = time.monotonic()
        is_wise = self._repeats.may(sequence_number, self.rate.budget_bps, self.rate.round_trip_s, now_s)
        if not is_wise and self._repeats.is_exhausted:
            self._wants_key(self)  # that picture is lost, and all that build on it
        times = (2 if self._copies.doubles_repeats else 1) if is_wise else 0
        self.rate.sent(times * _PACKET_BYTES, now_s)
        return times

    def wants_copy(self, sequence_number: int, size_bytes: int) -> bool:
        if not isinstance(self.rate, PathRate):
            return False
        now_s = time.monotonic()
        most_bps = min(self.rate.most_bps(now_s), self._ceiling_bps or math.inf)
        is_wanted = self._copies.wants(size_bytes, most_bps - self.budget_bps, now_s)
        if is_wanted:
            self._repeats.note(sequence_number, now_s)
            self.rate.sent(size_bytes, now_s)
        return is_wanted

    def pause_s(self, size_bytes: int) -> float:
        path_bps = self.rate.trains_bps if isinstance(self.rate, PathRate) else None
        return self._pacer.wait_s(size_bytes, self.budget_bps, time.monotonic(), path_bps, len(self._items))

    # -- what the stream calls -----------------------------------------------------------------------------------

    @property
    def is_watching(self) -> bool:
        return self.rate is not None

    @property
    def budget_bps(self) -> int:
        """For its pictures."""
        if not isinstance(self.rate, PathRate):
            return self.rate.budget_bps if self.rate is not None else 0
        is_limited = self.rate.is_limited(time.monotonic()) or 2 * self.rate.budget_bps > (
            self._ceiling_bps or math.inf
        )
        return self._copies.picture_bps(self.rate.budget_bps, is_limited=is_limited)

    def begin(
        self,
        options: Sequence[tuple[Hashable, Rung]],
        limits_bps: tuple[int, int],
        now_s: float,
        ceiling_bps: int | None = None,
    ) -> None:
        """It watches, or the source changed: choose among ``options``, best first, within least and most bit rate.
        ``ceiling_bps``: of pictures and copies together, where the user has set one."""
        self._ceiling_bps = ceiling_bps
        if self.rate is None:
            self.rate = RateControl(*limits_bps, now_s)
        else:
            self.rate.limit(*limits_bps)
        before, self._keys = self.switch.wanted, tuple(key for key, _ in options)
        rungs = [rung for _, rung in options]
        if self._choice is not None and before in self._keys:
            self._choice.stand_on(rungs, self._keys.index(before))
        else:
            self._choice = RungChoice(rungs, self.budget_bps, now_s) if rungs else None

    def target(self, now_s: float) -> Hashable | None:
        """What it shall be sent now; ``None`` while nothing is known of the source."""
        if self._choice is None:
            return None
        return self._keys[self._choice.decide(self.budget_bps, now_s)]

    def pause(self) -> None:
        """It looks away: what waits would be old by the time it looks again."""
        self._end_pause()
        self.rate = self._choice = self._told = None
        self.switch.want(None)
        self._items.clear()

    def tick(self, now_s: float) -> None:
        if self.rate is not None:
            self.rate.tick(now_s)

    def put(self, packet: av.Packet[Any]) -> int:
        """A packet of its rung; how many were dropped for it."""
        dropped = 0
        if packet.is_keyframe:
            self._end_pause()
        is_full = len(self._items) >= (MAX_WAITING_LOCAL if self.is_local else MAX_WAITING)
        if is_full or (packet.is_keyframe and not self.is_local):
            dropped = len(self._items)  # a key frame is newer than all that waits, and complete by itself
            self._items.clear()
        if dropped and not packet.is_keyframe:
            self.switch.tear()
            self._wants_key(self)
            return dropped + 1
        self._items.append(packet)
        self._arrived.set()
        return dropped

    def refuse(self, code: str) -> None:
        """No picture can come, and why; told once per watching."""
        if self._told != code:
            self._told = code
            self._unavailable(code)

    # -- a queue on the way --------------------------------------------------------------------------------------

    def _hear_path(self, seen: PathSeen, rate: RateControl | PathRate, now_s: float) -> None:
        if not isinstance(rate, PathRate):
            self.rate = rate = PathRate(*rate.limits_bps, now_s, rate.budget_bps)
        rate.handle(seen, now_s)
        self._copies.reported(seen.lost, seen.received, now_s, is_queued=rate.is_queued)
        if rate.paused_until_s > now_s:
            self._begin_pause(rate.paused_until_s)

    def _begin_pause(self, until_s: float) -> None:
        """Pictures sent now would only wait on the way. The bit rate is changed when it is over: a key frame of the new
        one would be as late."""
        self.switch.tear()
        self._items.clear()
        self._is_paused = True
        self._pause.set(until_s)

    def _go_on(self) -> None:
        self._is_paused = False
        self._changed()
        self._wants_key(self)

    def _end_pause(self) -> None:
        self._is_paused = False
        self._pause.cancel()
