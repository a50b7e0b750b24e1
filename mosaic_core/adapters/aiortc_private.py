"""The one module that touches names which aiortc and aioice keep to themselves; one contract test holds each.

Why any: aiortc answers only after STUN and TURN have answered or timed out (5 s), takes one TURN URL, keeps the RTP
origin and SCTP's queue to itself, and fixes the codec order before an answerer may speak.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from typing import Any

import aioice.ice
import aioice.turn
from aioice import Candidate, Connection
from aiortc import RTCIceCandidate, RTCIceTransport, RTCPeerConnection, RTCRtpSender, RTCRtpTransceiver
from aiortc.codecs import CODECS
from aiortc.rtcicetransport import candidate_from_aioice
from aiortc.rtcpeerconnection import find_common_codecs
from aiortc.rtcsctptransport import RTCSctpTransport
from aiortc.sdp import MediaDescription, SessionDescription, candidate_from_sdp, candidate_to_sdp

from mosaic_core.adapters.name_lookup import address_of, ipv4_of
from mosaic_core.words.errors import ConnectionFailed
from mosaic_core.words.ice import IceServer, IceUrl, parse_ice_url

__all__ = [
    "EarlyGathering",
    "MediaDescription",
    "RtpOriginLearner",
    "SctpQueue",
    "SessionDescription",
    "candidate_from_sdp",
    "candidate_to_sdp",
    "has_common_codec",
    "ice_transports",
    "name_stream",
    "prefer_codecs",
    "ssrc_of",
    "widen_udp_buffer",
]

_log = logging.getLogger(__name__)

UDP_BUFFER_BYTES = 4 * 1024 * 1024
"""aioice asks for 256 KiB; small messages are lost in bursts with less than 4 MiB. The kernel caps it at rmem_max."""
LATE_CANDIDATE_TIMEOUT_S = 10.0
"""After this a STUN or TURN server counts as dead; nobody waits for it."""
_MODULUS = 1 << 32
_COMPONENT = 1


def widen_udp_buffer() -> None:
    """Ask for larger receive buffers on every ICE socket that is opened from now on."""
    aioice.turn.UDP_SOCKET_BUFFER_SIZE = UDP_BUFFER_BYTES


def ice_transports(pc: RTCPeerConnection) -> list[RTCIceTransport]:
    """The distinct ICE transports that the next local description gathers for; with BUNDLE there is one."""
    transports = [transceiver.receiver.transport.transport for transceiver in pc.getTransceivers()]
    if pc.sctp is not None:
        transports.append(pc.sctp.transport.transport)
    return list(dict.fromkeys(transports))


class EarlyGathering:
    """Host candidates at once, reflexive and relayed ones as they come.

    :meth:`install` replaces ``gather_candidates`` of one ICE connection. Every STUN and TURN URL is asked at the
    same time. Only a machine without any host address waits for the first relayed one.
    """

    def __init__(
        self,
        transport: RTCIceTransport,
        servers: Sequence[IceServer],
        on_candidate: Callable[[RTCIceCandidate], None],
        on_complete: Callable[[], None],
    ) -> None:
        self._connection: Connection = transport._connection
        self._servers = [(parse_ice_url(url), server) for server in servers for url in server.urls]
        self._on_candidate = on_candidate
        self._on_complete = on_complete
        self._late: set[asyncio.Task[None]] = set()
        self._first_relay = asyncio.Event()
        self._answered = False

    @property
    def is_complete(self) -> bool:
        return self._answered and not self._late

    def install(self) -> None:
        self._connection.gather_candidates = self._gather  # type: ignore[method-assign]

    def cancel(self) -> None:
        """Stop asking; call it before the peer connection closes."""
        for task in list(self._late):
            task.cancel()

    async def _gather(self) -> None:
        connection = self._connection
        if connection._local_candidates_start:
            return
        connection._local_candidates_start = True
        addresses = aioice.ice.get_host_addresses(use_ipv4=True, use_ipv6=True)
        hosts = await connection.get_component_candidates(_COMPONENT, addresses)
        connection._local_candidates += hosts
        self._ask_servers()
        if not hosts:
            await self._wait_for_relay()
        connection._local_candidates_end = True
        self._answered = True
        if not self._late:
            self._on_complete()

    async def _wait_for_relay(self) -> None:
        with suppress(TimeoutError):
            async with asyncio.timeout(LATE_CANDIDATE_TIMEOUT_S if self._late else 0):
                await self._first_relay.wait()
        if not self._connection._local_candidates:
            raise ConnectionFailed("This machine has no network address that WebRTC can use.", code="ice.no_address")

    def _ask_servers(self) -> None:
        for url, server in self._servers:
            if url.scheme.startswith("turn"):
                self._start(url, self._relayed(url, server))
            else:
                for protocol in list(self._connection._protocols):
                    if ":" not in protocol.local_candidate.host:
                        self._start(url, self._reflexive(url, protocol))

    def _start(self, url: IceUrl, work: Any) -> None:
        task = asyncio.create_task(self._attempt(url, work))
        self._late.add(task)
        task.add_done_callback(self._finished)

    def _finished(self, task: asyncio.Task[None]) -> None:
        self._late.discard(task)
        if not self._late and self._answered and not self._connection._closing:
            self._on_complete()

    async def _attempt(self, url: IceUrl, work: Any) -> None:
        try:
            async with asyncio.timeout(LATE_CANDIDATE_TIMEOUT_S):
                await work
        except (OSError, aioice.stun.TransactionError, TimeoutError) as error:
            _log.info("ICE server %s gave no address: %s", url, error or type(error).__name__)

    async def _reflexive(self, url: IceUrl, protocol: Any) -> None:
        server = (await ipv4_of(url.host), url.port)
        candidate, _ = await aioice.ice.server_reflexive_candidate(protocol, server)
        self._offer(candidate)

    async def _relayed(self, url: IceUrl, server: IceServer) -> None:
        is_secure = url.scheme == "turns"  # its certificate names the host: don't resolve it here
        host = url.host if is_secure else await address_of(url.host)
        candidate, protocol = await aioice.ice.relayed_candidate(
            component=_COMPONENT,
            hide_related_address=False,
            protocol_factory=lambda: aioice.ice.StunProtocol(self._connection),
            turn_server=(host, url.port),
            turn_username=server.username,
            turn_password=server.credential,
            turn_ssl=is_secure,
            turn_transport=url.transport,
        )
        if self._connection._closing or self._connection._check_list_done:
            await protocol.close()  # a path was found without it: give the allocation back
            return
        self._connection._protocols.append(protocol)
        self._offer(candidate)
        self._first_relay.set()

    def _offer(self, candidate: Candidate) -> None:
        connection = self._connection
        known = {(local.host, local.port) for local in connection._local_candidates}
        if connection._closing or (candidate.host, candidate.port) in known:
            return
        connection._local_candidates.append(candidate)
        for remote in list(connection._remote_candidates):
            connection._pair_remote_candidate(remote)
        connection.sort_check_list()
        if self._answered:  # before that, the description itself carries it
            self._on_candidate(candidate_from_aioice(candidate))


def has_common_codec(kind: str, offered: Iterable[Any]) -> bool:
    """Whether aiortc would find a codec for a media line with these ``offered`` codecs."""
    return bool(find_common_codecs(CODECS[kind], list(offered)))


def prefer_codecs(transceiver: RTCRtpTransceiver, order: Sequence[str]) -> None:
    """Sort the negotiated codecs by MIME type, retransmission right behind its codec; the first one is sent."""
    rank = {mime_type.lower(): position for position, mime_type in enumerate(order)}
    codecs = transceiver._codecs
    plain = sorted(
        (codec for codec in codecs if codec.name.lower() != "rtx"),
        key=lambda codec: rank.get(codec.mimeType.lower(), len(rank)),
    )
    repeats = [codec for codec in codecs if codec.name.lower() == "rtx"]
    transceiver._codecs = [
        codec for base in plain for codec in (base, *(r for r in repeats if r.parameters["apt"] == base.payloadType))
    ]


def name_stream(sender: RTCRtpSender, label: str) -> None:
    """Make the sender's stream id the label: browsers read it as ``streams[0].id``."""
    sender._stream_id = label


def ssrc_of(sender: RTCRtpSender) -> int:
    return int(sender._ssrc)


class RtpOriginLearner:
    """Learns what aiortc adds to a picture's pts, from the timestamp of the last packet that the sender sent."""

    def __init__(self, sender: RTCRtpSender) -> None:
        self._sender = sender
        self._before = self._timestamp()

    def learn(self, last_pts: int) -> int | None:
        """The origin, if the picture with ``last_pts`` has left by now."""
        timestamp = self._timestamp()
        if timestamp == self._before:
            return None
        return (timestamp - last_pts) % _MODULUS

    def _timestamp(self) -> int:
        return int(self._sender._RTCRtpSender__rtp_timestamp)  # type: ignore[attr-defined]


class SctpQueue:
    """What waits in SCTP's queues of one peer connection, and the moments when it gets less."""

    def __init__(self, sctp: RTCSctpTransport, on_progress: Callable[[], None]) -> None:
        self._sctp = sctp
        self._on_progress = on_progress
        self._flush = sctp._data_channel_flush
        sctp._data_channel_flush = self._flush_and_tell  # type: ignore[method-assign]

    @property
    def queued_bytes(self) -> int:
        """Bytes not yet handed to the network: messages that wait for SCTP and chunks that wait for its window."""
        messages = sum(len(data) for _, _, data in self._sctp._data_channel_queue)
        return messages + sum(len(chunk.user_data) for chunk in self._sctp._outbound_queue)

    async def _flush_and_tell(self) -> None:
        await self._flush()
        self._on_progress()
