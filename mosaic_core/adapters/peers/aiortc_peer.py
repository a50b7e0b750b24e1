"""Wraps a peer connection of aiortc, for what both sides share: gathering, candidates, states, and an end that never
hangs."""

from __future__ import annotations

import asyncio
import logging
import os
from collections.abc import Callable, Collection, Sequence
from contextlib import suppress
from functools import partial

from aiortc import RTCBundlePolicy, RTCConfiguration, RTCIceCandidate, RTCIceTransport, RTCPeerConnection
from aiortc.exceptions import InternalError, InvalidAccessError, InvalidStateError, OperationError
from aiortc.sdp import candidate_from_sdp, candidate_to_sdp

from mosaic_core.adapters.aiortc_private.dtls import speak_dtls_with_everyone
from mosaic_core.adapters.aiortc_private.ice.fair_turns import take_turns
from mosaic_core.adapters.aiortc_private.ice.gathering import (
    EarlyGathering,
    ice_transports,
    transports_by_mid,
    widen_udp_buffer,
)
from mosaic_core.adapters.aiortc_private.ice.liveness import watch_liveness
from mosaic_core.adapters.aiortc_private.ice.paths import bound_learned_paths, chosen_path, keep_off_loopback
from mosaic_core.adapters.aiortc_private.rtp.receivers import bound_sources
from mosaic_core.adapters.aiortc_private.sctp.quick_sctp import quicken
from mosaic_core.adapters.peers.aiortc_channel import PeerBuffer
from mosaic_core.adapters.peers.offer_vetting import mids_of, without_end_of_candidates
from mosaic_core.machines.peers.chosen_path import ChosenPath
from mosaic_core.runtime.timing.background_tasks import BackgroundTasks
from mosaic_core.words.ice import IceServer
from mosaic_core.words.signaling import IceCandidate

_log = logging.getLogger(__name__)

PLAIN_SCTP_VARIABLE = "MOSAIC_PLAIN_SCTP"
"""Set it to ``1`` to run data channels on aiortc's own SCTP, to compare or if ours is under suspicion. Aiortc's
keeps whatever the other side sends, without any bound: among friends only."""
MAX_REMOTE_CANDIDATES = 64
"""A browser has about ten. Each is paired with all of ours, and its name is looked up."""
CLOSE_TIMEOUT_S = 1.0
"""Saying good-bye to a dead TURN server takes half a minute; after this it goes on without us."""
_TOLD_STATES = ("connecting", "connected", "failed", "closed")


class AiortcPeer:
    """Wraps one ``RTCPeerConnection``. ICE servers are always given explicitly: aiortc's default is a public one."""

    ERRORS = (
        InternalError, InvalidAccessError, InvalidStateError, OperationError, ValueError, AssertionError, LookupError,
        AttributeError, TypeError,
    )  # fmt: skip
    """What aiortc raises at a description that it does not like."""

    def __init__(
        self,
        ice_servers: Sequence[IceServer],
        bundle: RTCBundlePolicy,
        on_candidate: Callable[[IceCandidate], None],
        on_state: Callable[[str], None],
        on_excess: Callable[[str], None],
        *,
        relay_only: bool = False,
        takes_loopback: bool = True,
    ) -> None:
        """``takes_loopback``: a remote candidate may lead to this machine's own loopback."""
        widen_udp_buffer()
        self.pc = RTCPeerConnection(RTCConfiguration(iceServers=[], bundlePolicy=bundle))
        speak_dtls_with_everyone(self.pc)
        self.buffer = PeerBuffer(self.pc)
        self._ice_servers = ice_servers
        self._on_candidate = on_candidate
        self._on_state = on_state
        self._on_excess = on_excess
        self._relay_only = relay_only
        self._takes_loopback = takes_loopback
        self._gatherings: list[EarlyGathering] = []
        self._is_described = False
        self._early: list[IceCandidate] = []
        self._unsent: list[tuple[RTCIceTransport, str]] = []
        self._lines: dict[RTCIceTransport, tuple[str, int]] = {}
        self._adding, self._ending = BackgroundTasks(), BackgroundTasks()
        self._has_all_remote = False
        self._remote_candidates = 0
        self._closing: asyncio.Task[None] | None = None
        self.pc.on("connectionstatechange", self._state_changed)
        self.pc.on("iceconnectionstatechange", self._path_changed)

    async def describe_locally(self, refused: Collection[str] = ()) -> str:
        """Set the local description and return it at once, with the host candidates. ``refused``: the names of lines
        that the other side will not see in it."""
        for transport in ice_transports(self.pc):
            found = partial(self._found, transport)
            gathering = EarlyGathering(transport, self._ice_servers, found, self._gathered, relay_only=self._relay_only)
            gathering.install()
            take_turns(transport)
            bound_learned_paths(transport)
            if not self._takes_loopback:
                keep_off_loopback(transport)
            watch_liveness(transport, self._vanished)
            self._gatherings.append(gathering)
        bound_sources(self.pc)
        if self.pc.sctp is not None and os.environ.get(PLAIN_SCTP_VARIABLE) != "1":
            quicken(self.pc.sctp, self._on_excess)
        await self.pc.setLocalDescription()
        sdp = self.pc.localDescription.sdp
        # What was found meanwhile goes out after the description that it belongs to.
        asyncio.get_running_loop().call_soon(self._release, mids_of(sdp), refused)
        return sdp if self._is_gathered else without_end_of_candidates(sdp)

    async def describe_again(self) -> str:
        """The answer to a further offer on the same transport: there is nothing to gather."""
        await self.pc.setLocalDescription()
        return without_end_of_candidates(self.pc.localDescription.sdp)

    def described_remotely(self, candidates: Sequence[IceCandidate], has_all: bool) -> None:
        """The remote description is set: add its candidates, then those that came too early."""
        self._is_described = True
        self._has_all_remote = has_all
        for candidate in (*candidates, *self._early):
            self.add_candidate(candidate)
        self._early.clear()
        self._gathered()

    def add_candidate(self, candidate: IceCandidate) -> None:
        """Add a remote candidate; resolving its name takes place beside everything else."""
        if self._closing is not None or not candidate.candidate:
            return
        if not self._is_described:
            if len(self._early) < MAX_REMOTE_CANDIDATES:
                self._early.append(candidate)
            return
        self._remote_candidates += 1
        if self._remote_candidates > MAX_REMOTE_CANDIDATES:
            return
        try:
            parsed = candidate_from_sdp(candidate.candidate.removeprefix("candidate:"))
        except (ValueError, AssertionError, LookupError):
            _log.info("a remote ICE candidate could not be understood and is left out")
            return
        if candidate.sdp_mid:  # aiortc takes *either* as a match: give it one
            parsed.sdpMid = candidate.sdp_mid
        else:
            parsed.sdpMLineIndex = candidate.sdp_m_line_index
        self._adding.start(self._add(parsed))

    def path(self) -> ChosenPath | None:
        return chosen_path(self.pc)

    async def close(self) -> None:
        """End the connection; may be called often, returns within :data:`CLOSE_TIMEOUT_S`."""
        with suppress(TimeoutError):
            await asyncio.wait_for(asyncio.shield(self._closed()), CLOSE_TIMEOUT_S)

    def _closed(self) -> asyncio.Task[None]:
        if self._closing is None:
            for gathering in self._gatherings:
                gathering.cancel()
            self._adding.cancel()
            self._ending.cancel()
            self._closing = asyncio.create_task(self.pc.close())
        return self._closing

    def _vanished(self) -> None:
        if self._closing is None:
            self._on_state("failed")
            self._closed()

    @property
    def _is_gathered(self) -> bool:
        return bool(self._gatherings) and all(gathering.is_complete for gathering in self._gatherings)

    def _found(self, transport: RTCIceTransport, candidate: RTCIceCandidate) -> None:
        text = f"candidate:{candidate_to_sdp(candidate)}"
        if transport in self._lines:
            self._tell(transport, text)
        else:
            self._unsent.append((transport, text))

    def _release(self, mids: Sequence[str], refused: Collection[str]) -> None:
        """Candidates are told under the first line of their transport; all lines have one where they are bundled."""
        transports = transports_by_mid(self.pc)
        for index, mid in enumerate(mids):
            if mid in transports and mid not in refused:
                self._lines.setdefault(transports[mid], (mid, index))
        for transport, text in self._unsent:
            self._tell(transport, text)
        self._unsent.clear()

    def _tell(self, transport: RTCIceTransport, text: str) -> None:
        if self._closing is None and transport in self._lines:
            mid, index = self._lines[transport]
            self._on_candidate(IceCandidate(candidate=text, sdp_mid=mid, sdp_m_line_index=index))

    def _gathered(self) -> None:
        """The other side has sent all its candidates and we have all ours: from now on a failure is one."""
        if self._has_all_remote and self._is_described and self._is_gathered and self._closing is None:
            self._has_all_remote = False
            self._ending.start(self._end_candidates())

    async def _end_candidates(self) -> None:
        await self._adding.done()
        await self.pc.addIceCandidate(None)

    async def _add(self, candidate: RTCIceCandidate) -> None:
        try:
            await self.pc.addIceCandidate(candidate)
        except (ValueError, OSError) as error:
            _log.info("a remote ICE candidate was refused: %s", error)

    def _state_changed(self) -> None:
        if self.pc.connectionState in _TOLD_STATES:
            self._on_state(self.pc.connectionState)

    def _path_changed(self) -> None:
        if self.pc.iceConnectionState == "completed" and self.pc.connectionState == "connecting":
            self._on_state("securing")
