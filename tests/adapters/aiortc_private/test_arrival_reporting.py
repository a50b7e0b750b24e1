"""A Python operator offers reports of arrivals and sends them, without aiortc's help. Also the contract with aiortc."""

from __future__ import annotations

import asyncio
import inspect
from typing import Any

import pytest
from aiortc import RTCConfiguration, RTCPeerConnection, RTCSessionDescription
from aiortc.codecs import HEADER_EXTENSIONS
from aiortc.rtcdtlstransport import RTCDtlsTransport
from aiortc.rtcrtpparameters import RTCRtpHeaderExtensionParameters, RTCRtpParameters
from aiortc.rtp import HeaderExtensions, HeaderExtensionsMap, RtpPacket
from aiortc.sdp import SessionDescription

from mosaic_core.adapters.aiortc_private.rtp.packet_arrivals import NUMBER_URI, agree_on_arrivals
from mosaic_core.adapters.aiortc_private.rtp.reporting import (
    NUMBER_ID,
    ArrivalReporter,
    agreed_number_id,
    offer_reports,
)
from mosaic_core.laboratory.joining import until
from mosaic_core.machines.congestion.arrival_report import ArrivalReport, arrival_reports

EXTENSIONS = HeaderExtensionsMap()
EXTENSIONS.configure(
    RTCRtpParameters(
        headerExtensions=[
            RTCRtpHeaderExtensionParameters(id=1, uri="urn:ietf:params:rtp-hdrext:sdes:mid"),
            RTCRtpHeaderExtensionParameters(id=NUMBER_ID, uri=NUMBER_URI),
        ]
    )
)


class Line:
    """What a reporter touches of a transceiver and its transport."""

    def __init__(self) -> None:
        self.receiver, self.sender, self.transport = self, self, self
        self._ssrc = 7
        self.handled: list[bytes] = []
        self.sent: list[bytes] = []
        self.is_connected = True

    async def _handle_rtp_data(self, data: bytes, arrival_time_ms: int) -> None:
        self.handled.append(data)

    async def _send_rtp(self, data: bytes) -> None:
        if not self.is_connected:
            raise ConnectionError
        self.sent.append(data)

    async def receive(self, data: bytes) -> None:
        await self._handle_rtp_data(data, arrival_time_ms=1)


def packet(number: int | None) -> bytes:
    made = RtpPacket(payload_type=97, sequence_number=5, ssrc=4711, payload=b"picture")
    made.extensions = HeaderExtensions(mid="0", transport_sequence_number=number)
    return made.serialize(EXTENSIONS)


def reporter(line: Any, now_s: list[float]) -> ArrivalReporter:
    return ArrivalReporter(line, NUMBER_ID, lambda: now_s[0])


async def test_what_came_is_reported_together_and_handled_at_once() -> None:
    line, now_s = Line(), [1.0]
    reporter(line, now_s)
    for number, now_s[0] in ((3, 1.0), (4, 1.25), (6, 1.5)):
        await line.receive(packet(number))
    assert line.handled == [packet(3), packet(4), packet(6)]
    assert line.sent == []
    await until(lambda: line.sent)
    assert arrival_reports(line.sent[0]) == [ArrivalReport(3, (1.0, 1.25, None, 1.5))]
    assert line.sent[0][4:12] == (7).to_bytes(4, "big") + (4711).to_bytes(4, "big")
    await line.receive(packet(7))
    await until(lambda: len(line.sent) == 2)
    assert [rtcp[19] for rtcp in line.sent] == [1, 2]


@pytest.mark.parametrize(
    "data", [packet(None), packet(9)[:12], packet(9)[:14], packet(9)[:18], bytes(12), b"\x9f" + bytes(30)]
)
async def test_packets_without_a_number_are_handled_and_not_reported(data: bytes) -> None:
    line = Line()
    reporter(line, [1.0])
    await line.receive(data)
    await line.receive(packet(2))
    await until(lambda: line.sent)
    assert line.handled == [data, packet(2)]
    assert [report.first_number for rtcp in line.sent for report in arrival_reports(rtcp)] == [2]


async def test_a_connection_that_ended_is_no_error_and_reports_go_on_after_it() -> None:
    line = Line()
    reporting = reporter(line, [1.0])
    line.is_connected = False
    await line.receive(packet(2))
    await until(lambda: reporting._telling is None)
    line.is_connected = True
    await line.receive(packet(3))
    await until(lambda: line.sent)


async def offered(pc: RTCPeerConnection) -> str:
    pc.addTransceiver("video", direction="recvonly")
    pc.addTransceiver("audio", direction="recvonly")
    pc.createDataChannel("x")
    await pc.setLocalDescription()
    return pc.localDescription.sdp


@pytest.mark.parametrize("takes_it", [True, False])
async def test_reports_are_offered_for_pictures_and_sound_and_sent_only_if_they_are_taken(takes_it: bool) -> None:
    ours, theirs = (
        RTCPeerConnection(RTCConfiguration(iceServers=[])),
        RTCPeerConnection(RTCConfiguration(iceServers=[])),
    )
    try:
        plain = await offered(ours)
        offer = offer_reports(plain)
        sounds = [codec.payloadType for codec in SessionDescription.parse(plain).media[1].rtp.codecs]
        assert [line for line in offer.splitlines() if line not in plain.splitlines()] == [
            f"a=extmap:{NUMBER_ID} {NUMBER_URI}",
            *(f"a=rtcp-fb:{payload_type} transport-cc" for payload_type in (97, 99, 101)),
            f"a=extmap:{NUMBER_ID} {NUMBER_URI}",
            *(f"a=rtcp-fb:{payload_type} transport-cc" for payload_type in sounds),
        ]
        assert [NUMBER_URI in str(media) for media in SessionDescription.parse(offer).media] == [True, True, False]
        await theirs.setRemoteDescription(RTCSessionDescription(offer, "offer"))
        for transceiver in theirs.getTransceivers():
            if takes_it:
                assert agree_on_arrivals(transceiver, offer)
            transceiver.direction = "sendonly"
        answer = (await theirs.createAnswer()).sdp
        assert agreed_number_id(answer) == (NUMBER_ID if takes_it else None)
        await ours.setRemoteDescription(RTCSessionDescription(answer, "answer"))
    finally:
        await asyncio.gather(ours.close(), theirs.close())


def test_the_id_of_our_extension_is_free() -> None:
    assert NUMBER_ID not in {one.id for extensions in HEADER_EXTENSIONS.values() for one in extensions}
    assert NUMBER_URI not in {one.uri for extensions in HEADER_EXTENSIONS.values() for one in extensions}


def test_a_transport_hands_each_packet_to_a_method_of_the_instance() -> None:
    source = inspect.getsource(RTCDtlsTransport)
    assert "await self._handle_rtp_data(data, arrival_time_ms=arrival_time_ms)" in source
    assert list(inspect.signature(RTCDtlsTransport._handle_rtp_data).parameters) == ["self", "data", "arrival_time_ms"]
    assert "if is_rtcp(data):\n            data = self._tx_srtp.protect_rtcp(data)" in source
