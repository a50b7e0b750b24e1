"""The candidate pair that a peer connection uses; W3C's ``getSelectedCandidatePair``, which aiortc does not have."""

from __future__ import annotations

from aiortc import RTCPeerConnection

from mosaic_core.adapters.aiortc_private.ice.gathering import ice_transports
from mosaic_core.machines.peers.chosen_path import ChosenPath

_COMPONENT = 1


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
