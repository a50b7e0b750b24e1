"""Keeps an ICE connection from sending to this machine's own loopback, wherever a remote candidate may lead."""

from __future__ import annotations

import logging

from aioice import Candidate
from aiortc import RTCIceTransport

from mosaic_core.machines.peers.home_address import leads_home

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
