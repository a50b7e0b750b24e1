"""The candidate pair that a peer connection uses; W3C's ``getSelectedCandidatePair``, which aiortc does not have. None
leads to this machine's own loopback, wherever a remote candidate may lead, and nobody makes them ever more.
"""

from __future__ import annotations

import logging

from aioice import Candidate
from aioice.ice import StunProtocol
from aioice.stun import Message
from aiortc import RTCIceTransport, RTCPeerConnection

from mosaic_core.adapters.aiortc_private.ice.gathering import ice_transports
from mosaic_core.machines.peers.chosen_path import ChosenPath
from mosaic_core.machines.peers.home_address import leads_home

_COMPONENT = 1
MAX_PATHS = 128
"""Addresses of one operator: twice the candidates that it may tell, for behind NATs each may become another one."""


def chosen_path(pc: RTCPeerConnection) -> ChosenPath | None:
    """The path of the (one) bundled transport; ``None`` before ICE has found any."""
    for transport in ice_transports(pc):
        pair = transport._connection._nominated.get(_COMPONENT)
        if pair is not None:
            local, remote = pair.local_candidate, pair.remote_candidate
            return ChosenPath(
                local.type, remote.type, local.transport.lower(), _shown(local.host, local.port),
                _shown(remote.host, remote.port),
            )  # fmt: skip
    return None


def _shown(host: str, port: int) -> str:
    return f"[{host}]:{port}" if ":" in host else f"{host}:{port}"


logger = logging.getLogger(__name__)


def keep_off_loopback(transport: RTCIceTransport) -> None:
    """From now on; before the first remote candidate. Also a name that a stranger's answer leads there is refused: what
    is asked for is looked up first."""
    connection = transport._connection
    add = connection._add_remote_candidate

    def add_unless_it_leads_home(remote_candidate: Candidate, network_host: str) -> None:
        if leads_home(network_host):
            logger.info("a remote ICE candidate leads to this machine's loopback (%s) and is left out", network_host)
        else:
            add(remote_candidate, network_host)

    connection._add_remote_candidate = add_unless_it_leads_home  # type: ignore[method-assign]


def bound_learned_paths(transport: RTCIceTransport) -> None:
    """From now on: whoever asks from ever more ports, as the other side of a connection may, is answered and no more.
    aioice checks a path to each of them, and looks through all of them at every question."""
    connection = transport._connection
    check = connection.check_incoming

    def check_unless_too_many(message: Message, addr: tuple[str, int], protocol: StunProtocol) -> None:
        known = connection._remote_candidates
        if len(known) < MAX_PATHS or any((one._network_host, one.port) == addr[:2] for one in known):
            check(message, addr, protocol)

    connection.check_incoming = check_unless_too_many  # type: ignore[method-assign]
