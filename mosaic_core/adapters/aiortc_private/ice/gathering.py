"""ICE without waiting: host candidates at once, every STUN and TURN server asked at the same time.

aiortc answers only after STUN and TURN have answered or timed out (5 s), and takes one TURN URL.
"""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any, TypeAlias

import aioice.ice
import aioice.turn
from aioice import Candidate, Connection
from aiortc import RTCIceCandidate, RTCIceTransport, RTCPeerConnection
from aiortc.rtcicetransport import candidate_from_aioice

from mosaic_core.adapters.signaling.address_race import first_address
from mosaic_core.adapters.signaling.name_lookup import addresses_of, ipv4_addresses
from mosaic_core.adapters.signaling.named_tls import NamedTls
from mosaic_core.machines.timing.pacing import ComplaintPace
from mosaic_core.words.errors import ConnectionFailed
from mosaic_core.words.ice import IceServer, IceUrl, parse_ice_url

_log = logging.getLogger(__name__)

UDP_BUFFER_BYTES = 4 * 1024 * 1024
"""aioice asks for 256 KiB; small messages are lost in bursts with less than 4 MiB. The kernel caps it at rmem_max."""
LATE_CANDIDATE_TIMEOUT_S = 10.0
"""After this a STUN or TURN server counts as dead; nobody waits for it."""
TOLD_AGAIN_S = 3600.0
"""Every connection asks all servers: the log shall tell once of one that is dead."""
_dead_servers = ComplaintPace(TOLD_AGAIN_S)
_COMPONENT = 1
_Relayed: TypeAlias = tuple[Candidate, aioice.ice.StunProtocol]


def widen_udp_buffer() -> None:
    """Ask for larger receive buffers on every ICE socket that is opened from now on."""
    aioice.turn.UDP_SOCKET_BUFFER_SIZE = UDP_BUFFER_BYTES


def ice_transports(pc: RTCPeerConnection) -> list[RTCIceTransport]:
    """The distinct ICE transports that the next local description gathers for; with BUNDLE there is one."""
    transports = [transceiver.receiver.transport.transport for transceiver in pc.getTransceivers()]
    if pc.sctp is not None:
        transports.append(pc.sctp.transport.transport)
    return list(dict.fromkeys(transports))


def transports_by_mid(pc: RTCPeerConnection) -> dict[str, RTCIceTransport]:
    """The ICE transport of each line that has its name by now."""
    found = {line.mid: line.receiver.transport.transport for line in pc.getTransceivers()}
    if pc.sctp is not None:
        found[pc.sctp.mid] = pc.sctp.transport.transport
    return {mid: transport for mid, transport in found.items() if mid is not None}


class EarlyGathering:
    """Host candidates at once, reflexive and relayed ones as they come.

    :meth:`install` replaces ``gather_candidates`` of one ICE connection. Every STUN and TURN URL is asked at the
    same time. Only a machine without any host address waits for the first relayed one, and so does ``relay_only``,
    which has no other candidates.
    """

    def __init__(
        self,
        transport: RTCIceTransport,
        servers: Sequence[IceServer],
        on_candidate: Callable[[RTCIceCandidate], None],
        on_complete: Callable[[], None],
        *,
        relay_only: bool = False,
    ) -> None:
        self._connection: Connection = transport._connection
        self._servers = [(parse_ice_url(url), server) for server in servers for url in server.urls]
        self._on_candidate = on_candidate
        self._on_complete = on_complete
        self._relay_only = relay_only
        self._late: set[asyncio.Task[None]] = set()
        self._relay_settled = asyncio.Event()
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
        if not self._relay_only:
            addresses = aioice.ice.get_host_addresses(use_ipv4=True, use_ipv6=True)
            connection._local_candidates += await connection.get_component_candidates(_COMPONENT, addresses)
        has_hosts = bool(connection._local_candidates)
        self._ask_servers()
        if not has_hosts:
            await self._wait_for_relay()
        connection._local_candidates_end = True
        self._answered = True
        if not self._late:
            self._on_complete()

    async def _wait_for_relay(self) -> None:
        with suppress(TimeoutError):
            async with asyncio.timeout(LATE_CANDIDATE_TIMEOUT_S if self._late else 0):
                await self._relay_settled.wait()
        if self._connection._local_candidates:
            return
        if not self._relay_only:
            raise ConnectionFailed("This machine has no network address that WebRTC can use.", code="ice.no_address")
        raise ConnectionFailed("No TURN server gave an address, and nothing else may be used.", code="ice.no_relay")

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
        if not self._late:
            self._relay_settled.set()  # there is none, but nobody has to wait for that
        if not self._late and self._answered and not self._connection._closing:
            self._on_complete()

    async def _attempt(self, url: IceUrl, work: Any) -> None:
        try:
            await work
        except (OSError, aioice.stun.TransactionError, TimeoutError) as error:
            level = logging.INFO if _dead_servers.is_due(str(url), time.monotonic()) else logging.DEBUG
            _log.log(level, "ICE server %s gave no address: %s", url, error or type(error).__name__)

    async def _reflexive(self, url: IceUrl, protocol: Any) -> None:
        async def asked(address: str) -> Candidate:
            candidate, _ = await aioice.ice.server_reflexive_candidate(protocol, (address, url.port))
            return candidate

        self._offer(await first_address(ipv4_addresses(url.host), asked, LATE_CANDIDATE_TIMEOUT_S))

    async def _relayed(self, url: IceUrl, server: IceServer) -> None:
        tls = NamedTls.of(url.host) if url.scheme == "turns" else False

        async def allocated(address: str) -> _Relayed:
            return await aioice.ice.relayed_candidate(
                component=_COMPONENT,
                hide_related_address=False,
                protocol_factory=lambda: aioice.ice.StunProtocol(self._connection),
                turn_server=(address, url.port),
                turn_username=server.username,
                turn_password=server.credential,
                turn_ssl=tls,  # type: ignore[arg-type] # handed on to asyncio, which takes a context as well
                turn_transport=url.transport,
            )

        found = await first_address(addresses_of(url.host), allocated, LATE_CANDIDATE_TIMEOUT_S, _given_back)
        if self._connection._closing or self._connection._check_list_done:
            await _given_back(found)  # a path was found without it
            return
        candidate, protocol = found
        self._connection._protocols.append(protocol)
        self._offer(candidate)
        self._relay_settled.set()

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


async def _given_back(relayed: _Relayed) -> None:
    await relayed[1].close()
