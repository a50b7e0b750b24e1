"""Arrival times of single packets, as browsers report them (transport-wide congestion control), which aiortc does not
negotiate: each packet of a picture and each repeat carries a number of its own. Beside it stands the wish that the
picture is shown as soon as it is there.

Only with retransmission on a stream of its own (RTX), or with none as for sound: a packet sent twice under one RTP
sequence number must be the same bytes, or SRTP would encrypt two texts with one key stream.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from aiortc import RTCRtpSender, RTCRtpTransceiver
from aiortc.rtcrtpparameters import RTCRtcpFeedback, RTCRtpHeaderExtensionParameters, RTCRtpParameters
from aiortc.rtp import HeaderExtensions, HeaderExtensionsMap
from aiortc.sdp import SessionDescription

from mosaic_core.machines.congestion.arrival_report import NUMBERS, ArrivalReport, arrival_reports

NUMBER_URI = "http://www.ietf.org/id/draft-holmer-rmcat-transport-wide-cc-extensions-01"
PLAYOUT_URI = "http://www.webrtc.org/experiments/rtp-hdrext/playout-delay"
_FEEDBACK = RTCRtcpFeedback(type="transport-cc")
_ONE_BYTE_HEADER, _MOST_ONE_BYTE_ID = 0xBEDE, 14
_LONGEST_PLAYOUT = 50
"""In units of 10 ms, with 0 as the shortest. Chromium then shows pictures at once, instead of holding all of them back
for as long as the largest key frame needs; an operator who wants them smooth asks for at most this much."""


def agree_on_arrivals(transceiver: RTCRtpTransceiver, offer_sdp: str) -> bool:
    """Accept reports of arrivals for the codec that will be sent, if the offer has them. After the codecs are sorted,
    before the answer is made."""
    sent = transceiver._codecs[0]
    repeated = {codec.parameters["apt"] for codec in transceiver._codecs if codec.name == "rtx"}
    if transceiver.kind == "video" and sent.payloadType not in repeated:
        return False
    for media in SessionDescription.parse(offer_sdp).media:
        if media.rtp.muxId != transceiver.mid:
            continue
        extension = next((one for one in media.rtp.headerExtensions if one.uri == NUMBER_URI), None)
        offered = {codec.payloadType for codec in media.rtp.codecs if _FEEDBACK in codec.rtcpFeedback}
        if extension is None or sent.payloadType not in offered:
            return False
        for codec in transceiver._codecs:
            if codec.payloadType in offered:
                codec.rtcpFeedback.append(_FEEDBACK)
        transceiver._headerExtensions += [
            RTCRtpHeaderExtensionParameters(id=one.id, uri=one.uri)
            for one in media.rtp.headerExtensions
            if one.uri in (NUMBER_URI, PLAYOUT_URI)
        ]
        return True
    return False


def never_repeat(sender: RTCRtpSender) -> None:
    """Let no packet of a numbered stream without RTX be sent again, whoever asks for it."""

    async def nothing(sequence_number: int) -> None: ...

    sender._retransmit = nothing  # type: ignore[method-assign]


def sequence_number_of(data: bytes, ssrc: int) -> int:
    """Of an RTP packet of stream ``ssrc``, or of the packet that this one repeats (RFC 4588 §4)."""
    if int.from_bytes(data[8:12], "big") == ssrc:
        return int.from_bytes(data[2:4], "big")
    payload = 12 + 4 * (data[0] & 0x0F)
    if data[0] & 0x10:
        payload += 4 + 4 * int.from_bytes(data[payload + 2 : payload + 4], "big")
    return int.from_bytes(data[payload : payload + 2], "big")


class PacketNumbers:
    """Numbers what one sender sends. Each of ``arrived`` is called with each report that comes back on the connection,
    of this sender's packets and those of the others: once, however many senders name it."""

    def __init__(self, sender: RTCRtpSender, *arrived: Callable[[ArrivalReport], None]) -> None:
        self._connection = _Connection.of(sender.transport)
        listeners = self._connection.listeners
        listeners += [listener for listener in arrived if listener not in listeners]
        self._map = _SentExtensions(self._connection.next_number)
        sender._RTCRtpSender__rtp_header_extensions_map = self._map  # type: ignore[attr-defined]

    def take(self) -> int | None:
        """The number of the packet that was made just now; ``None`` if it has none."""
        number, self._map.number = self._map.number, None
        return number


class _SentExtensions(HeaderExtensionsMap):
    """A packet is made of its fields each time that it is sent: so a repeat has another number."""

    def __init__(self, next_number: Callable[[], int]) -> None:
        super().__init__()
        self._next_number = next_number
        self._playout = b""
        self.number: int | None = None

    def configure(self, parameters: RTCRtpParameters) -> None:
        super().configure(parameters)
        for extension in parameters.headerExtensions:
            if extension.uri == PLAYOUT_URI and extension.id <= _MOST_ONE_BYTE_ID:
                self._playout = bytes((extension.id << 4 | 2, 0, 0, _LONGEST_PLAYOUT))

    def set(self, values: HeaderExtensions) -> tuple[int, bytes]:
        self.number = values.transport_sequence_number = self._next_number()
        profile, data = super().set(values)
        return profile, data + self._playout if profile == _ONE_BYTE_HEADER else data


class _Connection:
    """The numbering of packets on one DTLS transport, for all its senders. The transport holds it, so that both go
    together."""

    def __init__(self, transport: Any) -> None:
        self.listeners: list[Callable[[ArrivalReport], None]] = []
        self._number = 0
        self._handle = transport._handle_rtcp_data
        transport._handle_rtcp_data = self._tell_and_handle

    @classmethod
    def of(cls, transport: Any) -> _Connection:
        holder = getattr(transport._handle_rtcp_data, "__self__", None)
        return holder if isinstance(holder, cls) else cls(transport)

    def next_number(self) -> int:
        self._number = (self._number + 1) % NUMBERS
        return self._number

    async def _tell_and_handle(self, data: bytes) -> None:
        for report in arrival_reports(data):
            for listener in self.listeners:
                listener(report)
        await self._handle(data)
