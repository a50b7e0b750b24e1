"""One test per private name of aiortc and aioice that we use: each fails loudly when a new version changes it."""

from __future__ import annotations

import asyncio
import inspect
from collections.abc import AsyncIterator, Collection
from contextlib import asynccontextmanager
from fractions import Fraction
from importlib.metadata import version
from types import SimpleNamespace
from typing import Any

import aioice.ice
import aioice.turn
import av
import pytest
from aiortc import RTCConfiguration, RTCPeerConnection, RTCSessionDescription
from aiortc.codecs import CODECS
from aiortc.codecs.h264 import H264Encoder
from aiortc.codecs.vpx import Vp8Encoder
from aiortc.rtcdtlstransport import RTCDtlsTransport
from aiortc.rtcicetransport import RTCIceGatherer, RTCIceTransport
from aiortc.rtcpeerconnection import find_common_codecs
from aiortc.rtcrtpparameters import RTCRtpHeaderExtensionParameters, RTCRtpParameters
from aiortc.rtcrtpreceiver import RTCRtpReceiver
from aiortc.rtcrtpsender import RTCRtpSender
from aiortc.rtcsctptransport import DataChunk, RTCSctpTransport
from aiortc.rtp import (
    RTCP_PSFB_APP,
    RTCP_PSFB_PLI,
    HeaderExtensions,
    HeaderExtensionsMap,
    RtcpPsfbPacket,
    RtpPacket,
    pack_remb_fci,
    unpack_header_extensions,
    wrap_rtx,
)

from mosaic_core.adapters.aiortc_private.ice.gathering import widen_udp_buffer
from mosaic_core.adapters.aiortc_private.rtp.codecs import prefer_codecs, sent_codec
from mosaic_core.adapters.aiortc_private.rtp.paced_transport import PacedTransport
from mosaic_core.adapters.aiortc_private.rtp.packet_arrivals import (
    NUMBER_URI,
    PLAYOUT_URI,
    PacketNumbers,
    agree_on_arrivals,
    sequence_number_of,
)
from mosaic_core.adapters.aiortc_private.rtp.receivers import rtp_timestamp_of
from mosaic_core.adapters.aiortc_private.rtp.senders import SenderFeedback
from mosaic_core.machines.congestion.arrival_report import ArrivalReport
from mosaic_core.machines.congestion.feedback import BandwidthEstimate, PictureLost

REPORT = bytes.fromhex("8fcd0005 00000001 00000002 0001 0001 000001 00 2001 04 00".replace(" ", ""))
"""Packet 1 arrived a millisecond after 64 ms."""


@asynccontextmanager
async def with_peer() -> AsyncIterator[Any]:
    pc = RTCPeerConnection(RTCConfiguration(iceServers=[]))
    try:
        yield pc
    finally:
        await pc.close()


def source_of(thing: Any) -> str:
    return inspect.getsource(thing)


def test_the_versions_are_those_that_were_read() -> None:
    assert version("aiortc").startswith("1.16.")
    assert version("aioice").startswith("0.13.")


async def test_an_ice_transport_has_its_connection_under_connection() -> None:
    async with with_peer() as pc:
        pc.createDataChannel("x")
        assert pc.sctp is not None
        transport = pc.sctp.transport.transport
        assert isinstance(transport._connection, aioice.Connection)
        assert transport.iceGatherer._connection is transport._connection


def test_the_selected_pair_of_a_component_is_under_nominated() -> None:
    assert "active_pair = self._nominated.get(component)" in source_of(aioice.ice.Connection)
    assert isinstance(aioice.Connection(ice_controlling=True)._nominated, dict)
    pair = source_of(aioice.ice.CandidatePair)
    assert "self.remote_candidate = remote_candidate" in pair
    assert "def local_candidate" in pair


def test_an_ice_connection_asks_for_consent_through_the_instance_once_it_has_a_path() -> None:
    source = source_of(aioice.ice.Connection)
    assert "asyncio.create_task(self.query_consent())" in source
    assert "request = self.build_request(pair, nominate=False)" in source_of(aioice.ice.Connection.query_consent)


def test_an_ice_connection_hears_datagrams_and_the_checks_of_the_other_side_through_the_instance() -> None:
    source = source_of(aioice.ice.StunProtocol.datagram_received)
    assert "self.receiver.data_received(data, self.local_candidate.component)" in source
    assert "self.receiver.request_received(message, addr, self)" in source


def test_datagrams_are_read_through_the_transports_own_recv_from_a_queue_of_its_connection() -> None:
    assert "data = await self.transport._recv()" in source_of(RTCDtlsTransport._recv_next)
    assert "self._recv = self._connection.recv" in source_of(RTCIceTransport.__init__)
    assert "result = await self._queue.get()" in source_of(aioice.ice.Connection.recvfrom)


def test_the_gatherer_calls_gather_candidates_of_the_instance_and_is_then_complete() -> None:
    assert "await self._connection.gather_candidates()" in source_of(RTCIceGatherer.gather)


def test_an_ice_transport_keeps_its_connection_for_good() -> None:
    assert "self._connection = gatherer._connection" in source_of(RTCIceTransport.__init__)


@pytest.mark.parametrize(
    "name",
    [
        "_local_candidates_start", "_local_candidates_end", "_local_candidates", "_remote_candidates", "_protocols",
        "_closing", "_check_list_done", "_pair_remote_candidate", "sort_check_list", "get_component_candidates",
    ],
)  # fmt: skip
async def test_an_ice_connection_has(name: str) -> None:
    assert hasattr(aioice.Connection(ice_controlling=True), name)


async def test_component_candidates_are_hosts_alone_when_no_server_is_set() -> None:
    connection = aioice.Connection(ice_controlling=True)
    addresses = aioice.ice.get_host_addresses(use_ipv4=True, use_ipv6=True)
    candidates = await connection.get_component_candidates(1, addresses)
    assert {candidate.type for candidate in candidates} == {"host"}
    assert [protocol.local_candidate for protocol in connection._protocols] == candidates
    await connection.close()


def test_server_reflexive_candidate_takes_a_protocol_and_a_server() -> None:
    assert list(inspect.signature(aioice.ice.server_reflexive_candidate).parameters) == ["protocol", "stun_server"]


def test_relayed_candidate_takes_what_we_give() -> None:
    assert set(inspect.signature(aioice.ice.relayed_candidate).parameters) == {
        "component", "hide_related_address", "protocol_factory", "turn_server", "turn_username", "turn_password",
        "turn_ssl", "turn_transport",
    }  # fmt: skip
    assert "ssl=turn_ssl" in source_of(aioice.ice.relayed_candidate), "a context of our own arrives at asyncio"


def test_an_association_counts_what_is_not_acknowledged() -> None:
    assert "self._flight_size = 0" in source_of(RTCSctpTransport.__init__)
    assert "+= chunk._book_size" in source_of(RTCSctpTransport._flight_size_increase)


def test_a_turn_endpoint_that_is_given_up_closes_its_socket() -> None:
    source = source_of(aioice.turn.create_turn_endpoint)
    assert source.index("except BaseException") < source.index("inner_transport.close()")


def test_a_stun_protocol_is_closed_and_that_is_waited_for() -> None:
    assert inspect.iscoroutinefunction(aioice.ice.StunProtocol.close)


def test_loopback_is_never_gathered() -> None:
    assert "127.0.0.1" not in aioice.ice.get_host_addresses(use_ipv4=True, use_ipv6=True)


def test_the_udp_buffer_is_read_from_the_module_at_each_socket() -> None:
    assert "turn.UDP_SOCKET_BUFFER_SIZE" in source_of(aioice.Connection.get_component_candidates)
    before = aioice.turn.UDP_SOCKET_BUFFER_SIZE
    try:
        widen_udp_buffer()
        assert aioice.turn.UDP_SOCKET_BUFFER_SIZE == 4 * 1024 * 1024
    finally:
        aioice.turn.UDP_SOCKET_BUFFER_SIZE = before


def test_common_codecs_are_found_by_the_function_that_set_remote_description_uses() -> None:
    assert "find_common_codecs(CODECS[media.kind], media.rtp.codecs)" in source_of(
        RTCPeerConnection.setRemoteDescription
    )
    assert find_common_codecs(CODECS["video"], CODECS["video"])
    assert not find_common_codecs(CODECS["video"], [])


async def test_the_first_codec_of_a_transceiver_is_the_one_that_is_sent() -> None:
    assert "self._run_rtp(parameters.codecs[0])" in source_of(RTCRtpSender.send)

    async with with_peer() as pc:
        transceiver = pc.addTransceiver("video")
        await pc.createOffer()
        prefer_codecs(transceiver, ["video/H264"])
        names = [codec.name for codec in transceiver._codecs]
        assert names[0] == "H264"
        assert sent_codec(transceiver) == "video/H264"
        assert sorted(names) == sorted(codec.name for codec in CODECS["video"])
        for codec, following in zip(transceiver._codecs, transceiver._codecs[1:], strict=False):
            if following.name == "rtx":
                assert following.parameters["apt"] == codec.payloadType


def test_the_codecs_and_extensions_of_every_line_are_set_anew_by_each_remote_description() -> None:
    source = source_of(RTCPeerConnection.setRemoteDescription)
    assert "transceiver._codecs = common" in source
    assert "transceiver._headerExtensions = find_common_header_extensions(" in source


async def test_a_receiver_counts_time_from_its_first_picture_and_keeps_that_ones_timestamp() -> None:
    assert "encoded_frame.timestamp = self.__timestamp_mapper.map(" in source_of(RTCRtpReceiver)

    async with with_peer() as pc:
        receiver, frame = pc.addTransceiver("video").receiver, av.VideoFrame(16, 16, "yuv420p")
        frame.pts = 0
        assert rtp_timestamp_of(receiver, frame) is None
        mapper = vars(receiver)["_RTCRtpReceiver__timestamp_mapper"]
        assert mapper._origin is None
        for on_the_wire in (2**32 - 3000, 2**32 - 1, 0, 3000):
            frame.pts = mapper.map(on_the_wire)
            assert rtp_timestamp_of(receiver, frame) == on_the_wire


def test_msid_is_made_of_the_senders_stream_and_track_ids() -> None:
    module = inspect.getmodule(RTCPeerConnection)
    assert "{transceiver.sender._stream_id} {transceiver.sender._track_id}" in source_of(module)


async def test_a_sender_has_its_ssrc_under_ssrc() -> None:
    async with with_peer() as pc:
        assert isinstance(pc.addTransceiver("video").sender._ssrc, int)


async def test_a_sender_keeps_the_timestamp_of_its_last_packet() -> None:
    async with with_peer() as pc:
        assert pc.addTransceiver("video").sender._RTCRtpSender__rtp_timestamp == 0  # type: ignore[attr-defined]
    assert "timestamp = uint32_add(timestamp_origin, enc_frame.timestamp)" in source_of(RTCRtpSender._run_rtp)


async def test_a_sender_is_asked_for_key_frames_and_given_reports_through_the_instance() -> None:
    assert "recipient._handle_rtcp_packet(packet)" in source_of(RTCDtlsTransport._handle_rtcp_data)
    assert "self._send_keyframe()" in source_of(RTCRtpSender._handle_rtcp_packet)
    assert "await self._retransmit(seq)" in source_of(RTCRtpSender._handle_rtcp_packet)

    async with with_peer() as pc:
        sender, heard = pc.addTransceiver("video").sender, []
        feed: Any = SimpleNamespace(heard=heard.append)
        SenderFeedback(sender, feed, lambda sequence_numbers: None)
        await sender._handle_rtcp_packet(RtcpPsfbPacket(fmt=RTCP_PSFB_PLI, ssrc=1, media_ssrc=sender._ssrc))
        fci = pack_remb_fci(600_000, [sender._ssrc])
        await sender._handle_rtcp_packet(RtcpPsfbPacket(fmt=RTCP_PSFB_APP, ssrc=1, media_ssrc=0, fci=fci))
        assert [type(feedback) for feedback in heard] == [PictureLost, BandwidthEstimate]


async def test_a_sender_remembers_its_last_report_and_when_it_left() -> None:
    async with with_peer() as pc:
        assert pc.addTransceiver("video").sender._RTCRtpSender__lsr is None  # type: ignore[attr-defined]
    source = source_of(RTCRtpSender._handle_rtcp_packet)
    assert "rtt = time.time() - self.__lsr_time - (report.dlsr / 65536)" in source


def test_packets_from_a_track_are_packed_as_they_are() -> None:
    source = source_of(RTCRtpSender._next_encoded_frame)
    assert "if isinstance(data, Frame):" in source
    assert "self.__encoder.pack(data)" in source
    packet: av.Packet[Any] = av.Packet(b"\x00\x00\x00\x01\x65\x88" + bytes(3000))
    packet.pts, packet.time_base = 9000, Fraction(1, 90_000)
    for encoder in (H264Encoder(), Vp8Encoder()):
        payloads, timestamp = encoder.pack(packet)
        assert len(payloads) == 3
        assert timestamp == 9000


class RecordingTransport:
    """What a sender's packets leave by."""

    def __init__(self) -> None:
        self.left: list[bytes] = []

    async def _send_rtp(self, data: bytes) -> None:
        self.left.append(data)

    async def _handle_rtcp_data(self, data: bytes) -> None: ...


def packet_of(sequence_number: int, *, is_last: bool = False) -> RtpPacket:
    packet = RtpPacket(payload_type=96, sequence_number=sequence_number, payload=b"picture")
    packet.marker = int(is_last)
    return packet


class Pace:
    """Notes what leaves, and has some of it sent twice."""

    def __init__(self, copied: Collection[int] = ()) -> None:
        self.copied, self.sizes = copied, list[int]()

    def wants_copy(self, sequence_number: int, size_bytes: int) -> bool:
        return sequence_number in self.copied

    async def paced(self, size_bytes: int) -> None:
        self.sizes.append(size_bytes)


async def test_a_sender_sends_its_pictures_through_its_transport_from_a_task_of_its_own() -> None:
    assert "await self.transport._send_rtp(packet_bytes)" in source_of(RTCRtpSender._run_rtp)
    assert "self.__rtp_task = asyncio.ensure_future(self._run_rtp(" in source_of(RTCRtpSender.send)

    async with with_peer() as pc:
        sender, sent, real = pc.addTransceiver("video").sender, [], RecordingTransport()
        sender.setTransport(real)  # type: ignore[arg-type]
        picture = packet_of(7).serialize()
        feed = Pace()
        PacedTransport(sender, feed, sent.append)  # type: ignore[arg-type]
        await sender.transport._send_rtp(picture)
        assert not feed.sizes
        sender._RTCRtpSender__rtp_task = asyncio.current_task()  # type: ignore[attr-defined]
        await sender.transport._send_rtp(picture)
        sender._RTCRtpSender__rtp_task = None  # type: ignore[attr-defined]
        assert real.left == [picture, picture]
        assert feed.sizes == [len(picture)]
        assert sent == [picture, picture]


async def test_packets_that_shall_be_copied_are_sent_again_after_their_picture() -> None:
    async with with_peer() as pc:
        sender = pc.addTransceiver("video").sender
        sender.setTransport(RecordingTransport())  # type: ignore[arg-type]
        again: asyncio.Queue[int] = asyncio.Queue()
        sender._retransmit = again.put  # type: ignore[method-assign]
        PacedTransport(sender, Pace(copied=(7, 9)), lambda data: None)  # type: ignore[arg-type]
        sender._RTCRtpSender__rtp_task = asyncio.current_task()  # type: ignore[attr-defined]
        for number in (7, 8, 9):
            assert again.empty()
            await sender.transport._send_rtp(packet_of(number, is_last=number == 9).serialize())
        sender._RTCRtpSender__rtp_task = None  # type: ignore[attr-defined]
        assert [await asyncio.wait_for(again.get(), 5) for _ in range(2)] == [7, 9]


def arrival_offer(*, with_rtx: bool = True, with_feedback: bool = True) -> str:
    lines = [
        "v=0", "o=- 1 2 IN IP4 127.0.0.1", "s=-", "t=0 0", "m=video 9 UDP/TLS/RTP/SAVPF 96 97", "c=IN IP4 0.0.0.0",
        "a=mid:0", "a=recvonly", "a=rtcp-mux", "a=setup:actpass", "a=ice-ufrag:abcd", "a=ice-pwd:" + "x" * 22,
        "a=fingerprint:sha-256 " + ":".join(["AB"] * 32), f"a=extmap:4 {NUMBER_URI}", f"a=extmap:5 {PLAYOUT_URI}",
        "a=rtpmap:96 VP8/90000",
        "a=rtcp-fb:96 nack", "a=rtcp-fb:96 transport-cc" if with_feedback else "a=rtcp-fb:96 nack pli",
    ]  # fmt: skip
    lines += ["a=rtpmap:97 rtx/90000", "a=fmtp:97 apt=96"] if with_rtx else []
    return "\r\n".join(lines) + "\r\n"


@pytest.mark.parametrize(
    ("lacking", "is_agreed"), [({}, True), ({"with_rtx": False}, False), ({"with_feedback": False}, False)]
)
async def test_reports_of_arrivals_are_agreed_on_only_with_repeats_of_their_own(
    lacking: dict[str, bool], is_agreed: bool
) -> None:
    async with with_peer() as pc:
        offer = arrival_offer(**lacking)
        await pc.setRemoteDescription(RTCSessionDescription(offer, "offer"))
        (transceiver,) = pc.getTransceivers()
        assert agree_on_arrivals(transceiver, offer) is is_agreed
        transceiver.direction = "sendonly"
        answer = await pc.createAnswer()
        assert (f"a=extmap:4 {NUMBER_URI}" in answer.sdp) is is_agreed
        assert (f"a=extmap:5 {PLAYOUT_URI}" in answer.sdp) is is_agreed
        assert ("a=rtcp-fb:96 transport-cc" in answer.sdp) is is_agreed


async def test_a_packet_is_made_of_its_fields_each_time_that_it_is_sent() -> None:
    assert "extensions_map.set(self.extensions)" in source_of(RtpPacket.serialize)
    for sends in (RTCRtpSender._run_rtp, RTCRtpSender._retransmit):
        assert "packet_bytes = packet.serialize(self.__rtp_header_extensions_map)" in source_of(sends)
    assert "await self._handle_rtcp_data(data)" in source_of(RTCDtlsTransport)

    async with with_peer() as pc:
        senders = [pc.addTransceiver("video").sender for _ in range(2)]
        transport, arrived = RecordingTransport(), []
        for sender in senders:
            sender.setTransport(transport)  # type: ignore[arg-type]
        own: list[ArrivalReport] = []
        numbers = [PacketNumbers(sender, arrived.append, lambda one: own.append(one)) for sender in senders]
        maps = [sender._RTCRtpSender__rtp_header_extensions_map for sender in senders]  # type: ignore[attr-defined]
        for one in maps:
            one.configure(RTCRtpParameters(headerExtensions=[RTCRtpHeaderExtensionParameters(id=4, uri=NUMBER_URI)]))
        packet = packet_of(7)
        made = [packet.serialize(one) for one in (maps[0], maps[1], maps[0])]
        assert [RtpPacket.parse(data, maps[0]).extensions.transport_sequence_number for data in made] == [1, 2, 3]
        assert [one.take() for one in numbers] == [3, 2]
        assert numbers[0].take() is None
        await transport._handle_rtcp_data(REPORT)
        assert [report.first_number for report in own] == [1, 1]
        assert [report.first_number for report in arrived] == [1], "who is named by both is told once"


async def test_each_packet_asks_for_its_picture_to_be_shown_at_once() -> None:
    async with with_peer() as pc:
        sender = pc.addTransceiver("video").sender
        sender.setTransport(RecordingTransport())  # type: ignore[arg-type]
        PacketNumbers(sender)
        extensions = sender._RTCRtpSender__rtp_header_extensions_map  # type: ignore[attr-defined]
        agreed = [(4, NUMBER_URI), (5, PLAYOUT_URI)]
        extensions.configure(
            RTCRtpParameters(headerExtensions=[RTCRtpHeaderExtensionParameters(id=one, uri=uri) for one, uri in agreed])
        )
        data = packet_of(7).serialize(extensions)
    profile, words = int.from_bytes(data[12:14], "big"), int.from_bytes(data[14:16], "big")
    shortest_and_longest = dict(unpack_header_extensions(profile, data[16 : 16 + 4 * words]))[5]
    assert shortest_and_longest == bytes([0, 0, 50]), "0 to 500 ms in twice twelve bits, tens of milliseconds each"
    assert RtpPacket.parse(data, extensions).payload == packet_of(7).payload


@pytest.mark.parametrize("extensions", [HeaderExtensions(), HeaderExtensions(mid="0", transport_sequence_number=3)])
def test_a_repeat_tells_what_it_repeats(extensions: HeaderExtensions) -> None:
    ids = HeaderExtensionsMap()
    ids.configure(
        RTCRtpParameters(
            headerExtensions=[
                RTCRtpHeaderExtensionParameters(id=4, uri=NUMBER_URI),
                RTCRtpHeaderExtensionParameters(id=1, uri="urn:ietf:params:rtp-hdrext:sdes:mid"),
            ]
        )
    )
    packet = packet_of(65_000)
    packet.ssrc, packet.extensions = 5, extensions
    repeat = wrap_rtx(packet, payload_type=97, sequence_number=12, ssrc=6)
    assert [sequence_number_of(one.serialize(ids), 5) for one in (packet, repeat)] == [65_000, 65_000]


async def test_an_association_has_the_queues_that_we_measure() -> None:
    async with with_peer() as pc:
        channel = pc.createDataChannel("x")
        assert pc.sctp is not None
        ((queued, _protocol, data),) = pc.sctp._data_channel_queue
        assert queued is channel
        assert isinstance(data, bytes)
        assert len(pc.sctp._outbound_queue) == 0
        assert DataChunk().user_data == b""


def test_a_selective_acknowledgement_flushes_the_channels_of_the_instance() -> None:
    assert "await self._data_channel_flush()" in source_of(RTCSctpTransport._receive_sack_chunk)


def test_aiortc_would_use_a_public_stun_server_by_default() -> None:
    assert RTCIceGatherer.getDefaultIceServers()  # which is why the list is never left out
