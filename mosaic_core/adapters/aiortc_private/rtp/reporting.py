"""Tells a robot when each of its packets arrived, as browsers do and aiortc does not (transport-wide congestion
control).

The robot numbers its packets only if its answer takes that from our offer; then each number is noted as it comes.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from struct import unpack_from
from typing import Any

from aiortc import RTCRtpTransceiver
from aiortc.rtp import unpack_header_extensions
from aiortc.sdp import SessionDescription

from mosaic_core.adapters.aiortc_private.rtp.packet_arrivals import NUMBER_URI
from mosaic_core.machines.congestion.arrival_log import ArrivalLog
from mosaic_core.machines.congestion.arrival_report import written

NUMBER_ID = 4
"""In our offers; aiortc has 1 to 3."""
REPORT_AFTER_S = 0.05
"""From the first packet that is not reported yet. A queue is seen so much later; a report takes about 40 bytes."""
_HEADER_BYTES = 12


def offer_reports(sdp: str) -> str:
    """Our offer ``sdp``, with reports of arrivals for all pictures and sounds that it may receive."""
    return "".join(_with_reports(sdp.splitlines(keepends=True)))


def _with_reports(lines: list[str]) -> Iterator[str]:
    is_media = False
    for line in lines:
        if line.startswith("m="):
            is_media = line.startswith(("m=video", "m=audio"))
        yield line
        if is_media and line.startswith("a=mid:"):
            yield f"a=extmap:{NUMBER_ID} {NUMBER_URI}\r\n"
        elif is_media and line.startswith("a=rtpmap:") and " rtx/" not in line:
            yield f"a=rtcp-fb:{line.split()[0].removeprefix('a=rtpmap:')} transport-cc\r\n"


def agreed_number_id(answer_sdp: str) -> int | None:
    """Under which id the robot numbers its packets; ``None``: it does not."""
    for media in SessionDescription.parse(answer_sdp).media:
        for extension in media.rtp.headerExtensions:
            if extension.uri == NUMBER_URI:
                return extension.id
    return None


class ArrivalReporter:
    """Reports the arrival of every packet on the transport of ``line``, from when it is made."""

    def __init__(self, line: RTCRtpTransceiver, number_id: int, clock: Callable[[], float] = time.monotonic) -> None:
        transport: Any = line.receiver.transport
        self._transport = transport
        self._number_id, self._ssrc = number_id, line.sender._ssrc
        self._clock = clock
        self._log = ArrivalLog()
        self._media_ssrc = 0
        self._count = 0
        self._telling: asyncio.Task[None] | None = None
        self._handle = transport._handle_rtp_data
        transport._handle_rtp_data = self._note_and_handle

    async def _note_and_handle(self, data: bytes, arrival_time_ms: int) -> None:
        number = _number_of(data, self._number_id)
        if number is not None:
            self._log.note(number, self._clock())
            self._media_ssrc = int.from_bytes(data[8:12], "big")
            if self._telling is None:
                self._telling = asyncio.create_task(self._tell())
        await self._handle(data, arrival_time_ms=arrival_time_ms)

    async def _tell(self) -> None:
        await asyncio.sleep(REPORT_AFTER_S)
        try:
            with suppress(ConnectionError):
                for report in self._log.take():
                    self._count += 1
                    await self._transport._send_rtp(written(report, self._ssrc, self._media_ssrc, self._count))
        finally:
            self._telling = None


def _number_of(data: bytes, number_id: int) -> int | None:
    """What the packet is numbered with; ``None`` also for one that is none."""
    start = _HEADER_BYTES + 4 * (data[0] & 0x0F)
    if not data[0] & 0x10 or len(data) < start + 4:
        return None
    profile, words = unpack_from("!HH", data, start)
    with suppress(ValueError):
        for found, value in unpack_header_extensions(profile, data[start + 4 : start + 4 + 4 * words]):
            if found == number_id and len(value) == 2:
                return int.from_bytes(value, "big")
    return None
