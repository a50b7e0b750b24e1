"""Declares what the operator needs from a peer connection, as Protocols; ``adapters.peers.aiortc_offerer`` implements
them.

Everything here is called on the event loop and calls back on the event loop.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

from mosaic_core.contract.sound import Sound
from mosaic_core.machines.media.first_frame import ReceivedSoFar
from mosaic_core.machines.peers.chosen_path import ChosenPath
from mosaic_core.runtime.transport.transport import Channel
from mosaic_core.words.ice import IceServer
from mosaic_core.words.signaling import IceCandidate


class IncomingVideo(Protocol):
    """The pictures of one camera."""

    async def next(self) -> Any:
        """The next ``av.VideoFrame``, or ``None`` at the end. Somebody must call it all the time, or frames pile up."""

    def rtp_timestamp(self, frame: Any) -> int | None:
        """The RTP timestamp that a frame came with; ``None`` where there is none."""

    async def received(self) -> ReceivedSoFar | None:
        """What has come of this track so far; ``None`` where nothing is counted."""

    def stop(self) -> None: ...


class OutgoingSound(Protocol):
    """The operator's own voice on its way to a loudspeaker of the robot."""

    def send(self, sound: Sound) -> bool:
        """Send one piece; ``False`` where older sound had to go, because the link does not take it. Raises
        :class:`TypeError` or :class:`ValueError` for what is no sound."""


class OffererListener(Protocol):
    """Hears what an operator-side peer connection tells."""

    def candidate_found(self, candidate: IceCandidate) -> None: ...
    def state_changed(self, state: str) -> None:
        """``connecting``, ``securing``, ``connected``, ``failed`` or ``closed``."""

    def track_arrived(self, label: str, video: IncomingVideo) -> None:
        """The robot gave a media line to ``label``."""


class Offerer(Protocol):
    """An operator-side peer connection."""

    def create_channel(
        self, label: str, *, protocol: str = "", ordered: bool = True, max_retransmits: int | None = None
    ) -> Channel:
        """Open a data channel, before or after the connection is up."""

    def add_video(self, label: str) -> None:
        """Add a line to receive ``label`` on; before the first channel and :meth:`offer`."""

    def add_microphone(self, label: str) -> None:
        """Add a line to hear ``label`` on; its frames come as those of a picture do. After the video lines."""

    def add_speaker(self, label: str) -> OutgoingSound:
        """Add a line to talk to ``label`` on. After the video lines."""

    async def offer(self) -> tuple[str, Mapping[str, str]]:
        """The offer's SDP at once, and which label each media line is for (mid → label)."""

    async def offer_more(self, pictures: Sequence[str]) -> tuple[str, Mapping[str, str]]:
        """A further offer on the live connection, with lines to receive these on too; the tracks of all lines."""

    async def accept_answer(self, sdp: str) -> None: ...
    async def add_candidate(self, candidate: IceCandidate) -> None: ...
    def path(self) -> ChosenPath | None:
        """The path that ICE chose; ``None`` before, and where it is not known."""

    async def close(self) -> None: ...


class OffererFactory(Protocol):
    """Makes an offerer for one attempt to connect."""

    def __call__(self, listener: OffererListener, ice_servers: Sequence[IceServer]) -> Offerer: ...
