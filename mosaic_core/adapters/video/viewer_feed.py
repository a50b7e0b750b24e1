"""Feeds one viewer of one camera: chooses which of the camera's encoded pictures it is sent."""

from __future__ import annotations

import asyncio
import time
from collections import deque
from collections.abc import Callable, Hashable, Sequence
from dataclasses import replace
from typing import Any

import av

from mosaic_core.adapters.video.video_encoder import CodecName
from mosaic_core.machines.congestion.budget_allocator import DRIVES, SEEN, Demand
from mosaic_core.machines.congestion.feedback import Feedback, PictureLost
from mosaic_core.machines.congestion.retransmissions import Retransmissions
from mosaic_core.machines.media.rung_choice import RungChoice
from mosaic_core.machines.media.rung_ladder import Rung
from mosaic_core.machines.media.rung_switch import RungSwitch
from mosaic_core.runtime.transport.media_transport import TellUnavailable
from mosaic_core.runtime.transport.peer_congestion import PeerCongestion

MAX_WAITING = 8
"""Packets that wait for one viewer's transport: a quarter of a second, then it goes on at the next key frame."""
MAX_WAITING_LOCAL = 64
"""Packets that wait for a tap: nobody looks at them live, so that two seconds of a busy event loop may lose none."""
_PACKET_BYTES = 1200
USUAL_PX = 640 * 360
"""On the screen of a viewer who doesn't tell."""
_CODECS: dict[str, CodecName] = {"video/vp8": "VP8", "video/h264": "H264"}


class ViewerFeed:
    """Feeds one viewer the packets of one camera; a ``runtime.transport.PictureFeed``. Event loop only.

    ``wants_key`` is called when this viewer can't go on without a key frame, ``changed`` when what it may be sent did.
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
        self.switch: RungSwitch[Hashable, av.Packet[Any]] = RungSwitch()
        self.connection = PeerCongestion()
        self.is_watching = False
        self._demand = Demand(0, 0, weight=USUAL_PX)
        self._ceiling_bps: int | None = None
        self._choice: RungChoice | None = None
        self._keys: tuple[Hashable, ...] = ()
        self._unavailable = unavailable
        self._wants_key = wants_key
        self._changed = changed
        self._told: str | None = None
        self._repeats = Retransmissions()
        self._items: deque[av.Packet[Any]] = deque()
        self._arrived = asyncio.Event()

    # -- what its track calls ------------------------------------------------------------------------------------

    def send_over(self, connection: PeerCongestion) -> None:
        self.connection = connection

    def codec_agreed(self, mime_type: str) -> None:
        self.codec = _CODECS[mime_type.lower()]

    def shown(self, size_px: int | None, *, leads: bool) -> None:
        rank, weight = DRIVES if leads else SEEN, max(1, size_px if size_px is not None else USUAL_PX)
        before, self._demand = self._demand, replace(self._demand, rank=rank, weight=weight)
        if self.is_watching and self._demand != before:
            self._want()

    async def next(self) -> av.Packet[Any]:
        while not self._items:
            self._arrived.clear()
            await self._arrived.wait()
            await self.connection.turn(len(self._items))
        packet = self._items.popleft()
        self.connection.sent(packet.size, is_key=packet.is_keyframe)
        return packet

    def heard(self, feedback: Feedback) -> None:
        if not self.is_watching:
            return
        self.connection.handle(self, feedback)
        if isinstance(feedback, PictureLost):
            self._wants_key(self)

    def repeats(self, sequence_number: int) -> int:
        if not self.is_watching:
            return 0
        part_bps, round_trip_s = self.connection.part_bps(self), self.connection.round_trip_s
        is_wise = self._repeats.may(sequence_number, part_bps, round_trip_s, time.monotonic())
        if not is_wise and self._repeats.is_exhausted:
            self._wants_key(self)  # that picture is lost, and all that build on it
        times = (2 if self.connection.doubles_repeats else 1) if is_wise else 0
        self.connection.sent(times * _PACKET_BYTES)
        return times

    def wants_copy(self, sequence_number: int, size_bytes: int) -> bool:
        is_wanted = self.is_watching and self.connection.wants_copy(size_bytes)
        if is_wanted:
            self._repeats.note(sequence_number, time.monotonic())
            self.connection.sent(size_bytes)
        return is_wanted

    async def paced(self, size_bytes: int) -> None:
        await self.connection.paced(size_bytes, len(self._items))

    # -- what the stream calls -----------------------------------------------------------------------------------

    @property
    def budget_bps(self) -> int:
        """For its pictures."""
        return self.connection.picture_bps(self)

    def begin(
        self,
        options: Sequence[tuple[Hashable, Rung]],
        limits_bps: tuple[int, int],
        now_s: float,
        ceiling_bps: int | None = None,
    ) -> None:
        """It watches, or the source changed: choose among ``options``, best first, within least and most bit rate.
        ``ceiling_bps``: of pictures and copies together, where the user has set one."""
        self.is_watching, self._ceiling_bps = True, ceiling_bps
        least_bps, most_bps = limits_bps
        self._demand = replace(self._demand, least_bps=least_bps, most_bps=most_bps)
        self._want()
        before, self._keys = self.switch.wanted, tuple(key for key, _ in options)
        rungs = [rung for _, rung in options]
        if self._choice is not None and before in self._keys:
            self._choice.stand_on(rungs, self._keys.index(before))
        else:
            self._choice = RungChoice(rungs, self.budget_bps, now_s, self._may_rise) if rungs else None

    def _want(self) -> None:
        self.connection.want(self, self._demand, self._changed, self._ceiling_bps)

    def _may_rise(self) -> bool:
        return self.connection.may_rise()

    def target(self, now_s: float) -> Hashable | None:
        """What it shall be sent now; ``None`` while nothing is known of the source."""
        if self._choice is None:
            return None
        return self._keys[self._choice.decide(self.budget_bps, now_s)]

    def pause(self) -> None:
        """It looks away: what waits would be old by the time it looks again."""
        self.is_watching = False
        self._choice = self._told = None
        self.switch.want(None)
        self._items.clear()
        self.connection.want_nothing(self)

    def offer(self, key: Hashable, packet: av.Packet[Any]) -> int:
        """A packet of any rung; how many were dropped for it."""
        taken = self.switch.taken(key, packet, is_key=packet.is_keyframe, captured_at=packet.pts or 0)
        return sum(self.put(one) for one in taken)

    def put(self, packet: av.Packet[Any]) -> int:
        """A packet of its rung; how many were dropped for it."""
        dropped = 0
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
