"""Declares what the runtime needs from the network, as Protocols; ``adapters`` implement them over aiortc and
websockets.

Everything here is called on the event loop and calls back on the event loop.
"""

from __future__ import annotations

from collections.abc import AsyncIterator, Callable, Mapping, Sequence
from typing import Protocol

from mosaic_core.machines.peers.chosen_path import ChosenPath
from mosaic_core.machines.peers.network_change import NetworkChange
from mosaic_core.runtime.transport.media_transport import NO_SOUND, IncomingSound, PictureFeed, SoundLabels
from mosaic_core.runtime.transport.peer_congestion import PeerCongestion
from mosaic_core.words.errors import ConnectionFailed
from mosaic_core.words.ice import IceServer
from mosaic_core.words.signaling import IceCandidate


class Channel(Protocol):
    """A data channel of a peer connection. Callbacks are plain attributes, set by the owner."""

    on_message: Callable[[bytes | str], None] | None
    on_open: Callable[[], None] | None
    on_close: Callable[[], None] | None
    on_drained: Callable[[], None] | None
    """``buffered_bytes`` fell to the low-water mark (``machines.delivery.send_scheduler.LOW_WATER_BYTES``)."""

    @property
    def label(self) -> str: ...

    @property
    def protocol(self) -> str: ...

    @property
    def is_reliable(self) -> bool: ...

    @property
    def is_first(self) -> bool:
        """Whoever made it had made no other channel before on this peer connection."""

    @property
    def is_open(self) -> bool: ...

    @property
    def buffered_bytes(self) -> int:
        """Bytes that wait in SCTP's queue of the whole peer connection."""

    @property
    def window_bytes(self) -> int:
        """What the peer connection may have on its way at present (SCTP's congestion window)."""

    @property
    def under_way_bytes(self) -> int:
        """Bytes of the peer connection that are on their way: handed to the network, and not acknowledged yet."""

    def give_way(self, on: bool) -> None:
        """Whether the data of the whole peer connection leaves a path that others use to them, as bulk should."""

    def send(self, data: bytes | str) -> None:
        """Queue one message; raises :class:`ConnectionFailed` when the channel isn't open."""

    def close(self) -> None: ...


class OfferRefused(ConnectionFailed):
    """Every line of the offer is refused. ``answer`` says it in the words of WebRTC."""

    def __init__(self, message: str, answer: str) -> None:
        super().__init__(message, code="sdp.no_common_codec")
        self.answer = answer


class LineListener(Protocol):
    """Hears what becomes of the media lines of an operator's offers."""

    def track_bound(self, label: str) -> PictureFeed:
        """A media line of the offer was given to ``label``; the feed may stay silent for ever."""

    def voice_bound(self, label: str, sound: IncomingSound) -> None:
        """A line of the offer on which the operator talks was given to the loudspeaker ``label``."""

    def tracks_unbound(self, labels: Sequence[str]) -> None:
        """The offer had no line for these."""

    def track_refused(self, label: str, cause: str) -> None:
        """The line for this one is refused: no codec is shared. ``cause`` names what was offered and what we have."""

    def origin_known(self, label: str, ssrc: int, rtp_origin: int) -> None:
        """RTP timestamp = capture time x 90 kHz + ``rtp_origin`` (mod 2^32). Told once per track."""


class AnswererListener(Protocol):
    """Hears what a robot-side peer connection tells."""

    @property
    def media(self) -> LineListener:
        """Hears of the lines of the labels that :meth:`Answerer.answer` is given."""

    @property
    def is_local(self) -> bool:
        """Whether the operator came over this machine's loopback; nobody else is led to what listens there."""

    @property
    def congestion(self) -> PeerCongestion:
        """One for all peer connections with this operator."""

    def candidate_found(self, candidate: IceCandidate) -> None: ...
    def channel_opened(self, channel: Channel) -> None: ...
    def state_changed(self, state: str) -> None:
        """``connecting``, ``securing`` (a path is found, DTLS runs; may be left out), ``connected``, ``failed`` or
        ``closed``."""

    def bound_exceeded(self, why: str) -> None:
        """The other side made us keep too much; nothing more of it is taken. Close it."""


class Answerer(Protocol):
    """A robot-side peer connection."""

    async def answer(
        self,
        offer_sdp: str,
        media_labels: Sequence[str],
        tracks: Mapping[str, str] | None,
        sound: SoundLabels = NO_SOUND,
    ) -> str:
        """Vet and apply the offer, bind tracks, return the answer's SDP at once; candidates follow by listener.

        A further offer on the live connection may add lines; what has one keeps it.
        ``media_labels`` are the robot's cameras in YAML order, ``tracks`` the operator's wish (mid → label).
        A line without a common codec is refused in the answer. Raises :class:`ConnectionFailed` with ``sdp.invalid``,
        and :class:`OfferRefused` if there is no other line.
        """

    async def add_candidate(self, candidate: IceCandidate) -> None:
        """Add a remote candidate; a bad one is logged and dropped."""

    def path(self) -> ChosenPath | None:
        """The path that ICE chose; ``None`` before, and where it is not known."""

    async def close(self) -> None: ...


class AnswererFactory(Protocol):
    """Makes an answerer for one peer."""

    def __call__(self, listener: AnswererListener, ice_servers: Sequence[IceServer]) -> Answerer: ...


class TextSocket(Protocol):
    """An open WebSocket with text frames."""

    def __aiter__(self) -> AsyncIterator[str]:
        """The frames; ends when the socket closes."""

    async def send(self, text: str) -> None: ...
    async def close(self, code: int = 1000, reason: str = "") -> None: ...

    @property
    def close_code(self) -> int | None:
        """The other side's close code, once closed."""


class NetworkWatcher(Protocol):
    """Watches this machine's network, and calls ``changed`` for every change, until it is cancelled."""

    async def __call__(self, changed: Callable[[NetworkChange], None]) -> None:
        """Call ``changed`` at every change of this machine's network, until cancelled."""


class SocketConnector(Protocol):
    """Opens a WebSocket to a server."""

    async def __call__(self, url: str) -> TextSocket:
        """Open ``url``; raises :class:`SignalingError` (``signal.unreachable``) with the cause in words."""
