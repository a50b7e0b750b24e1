"""The robot's side of a peer connection over aiortc: vet the offer, bind tracks to its lines, answer at once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from aiortc import RTCBundlePolicy, RTCDataChannel, RTCRtpTransceiver, RTCSessionDescription

from mosaic_core.adapters.aiortc_private.rtp.codecs import KeptLines, prefer_codecs, sent_codec
from mosaic_core.adapters.aiortc_private.rtp.packet_arrivals import agree_on_arrivals
from mosaic_core.adapters.aiortc_private.rtp.senders import name_stream, ssrc_of
from mosaic_core.adapters.peers.aiortc_channel import AiortcChannel
from mosaic_core.adapters.peers.aiortc_peer import AiortcPeer
from mosaic_core.adapters.peers.offer_vetting import (
    OfferedLine,
    VettedOffer,
    lines_for_labels,
    sound_lines,
    vetted_offer,
)
from mosaic_core.adapters.peers.refused_lines import nothing_but_refusals, with_refusals
from mosaic_core.adapters.sound.sound_lines import SoundLines
from mosaic_core.adapters.video.video_track import VideoTrack
from mosaic_core.machines.peers.chosen_path import ChosenPath
from mosaic_core.runtime.transport.media_transport import NO_SOUND, SoundLabels
from mosaic_core.runtime.transport.transport import AnswererListener, OfferRefused
from mosaic_core.words.errors import ConnectionFailed
from mosaic_core.words.ice import IceServer
from mosaic_core.words.signaling import IceCandidate

CODEC_ORDER = ("video/VP8", "video/H264")
"""Of what a feed does not care about."""


class AiortcAnswerer:
    """Answers the offers of one operator over aiortc; a ``runtime.transport.Answerer``."""

    def __init__(
        self, listener: AnswererListener, ice_servers: Sequence[IceServer], *, relay_only: bool = False
    ) -> None:
        self._listener = listener
        self._relay_only = relay_only
        self._ice_servers = ice_servers
        self._peer: AiortcPeer | None = None
        self._offer: VettedOffer | None = None
        self._congestion = listener.congestion
        self._served: set[str] = set()
        self._refused: set[str] = set()
        self._early: list[IceCandidate] = []
        self._is_closed = False

    async def answer(
        self,
        offer_sdp: str,
        media_labels: Sequence[str],
        tracks: Mapping[str, str] | None,
        sound: SoundLabels = NO_SOUND,
    ) -> str:
        """Answers as :class:`mosaic_core.runtime.transport.transport.Answerer` says; also raises ``ice.no_address`` and
        ``ice.no_relay``."""
        if self._is_closed:
            raise ConnectionFailed("This peer connection is closed.", code="sdp.invalid")
        offer = vetted_offer(offer_sdp)
        cameras, heard, talking = (
            [label for label in labels if label not in self._served]
            for labels in (media_labels, sound.microphones, sound.speakers)
        )
        wishes = _Wishes(cameras, SoundLabels(heard, talking), tracks)
        if self._peer is not None:
            sdp = await self._answer_again(offer, wishes)
        elif offer.is_refused:
            self._allot(offer, offer.lines, wishes)
            causes = " ".join(line.cause for line in offer.refused if line.offered)
            raise OfferRefused(causes or "Every line is given up.", nothing_but_refusals(offer.refused))
        else:
            sdp = await self._answer_first(offer, wishes)
        return with_refusals(sdp, offer.refused)

    async def _answer_first(self, offer: VettedOffer, wishes: _Wishes) -> str:
        peer, self._offer = self._new_peer(offer), offer
        self._peer = peer
        try:
            await peer.pc.setRemoteDescription(RTCSessionDescription(offer.sdp, "offer"))
        except peer.ERRORS as error:
            raise _refused(error) from error
        self._bind(peer, offer, offer.lines, wishes)
        sdp = await peer.describe_locally(offer.refused_mids)
        peer.described_remotely((*offer.candidates, *self._early), offer.has_all_candidates)
        self._early.clear()
        return sdp

    async def _answer_again(self, offer: VettedOffer, wishes: _Wishes) -> str:
        """A further offer adds lines to the live connection; what has one keeps it."""
        assert self._peer is not None
        assert self._offer is not None
        offer.refuse_unless_it_adds_to(self._offer)
        peer, kept = self._peer, KeptLines(self._peer.pc)
        try:
            await peer.pc.setRemoteDescription(RTCSessionDescription(offer.sdp, "offer"))
            kept.restore()
        except peer.ERRORS as error:
            raise _refused(error) from error
        self._bind(peer, offer, offer.lines[len(self._offer.lines) :], wishes)
        self._offer = offer
        return await peer.describe_again()

    async def add_candidate(self, candidate: IceCandidate) -> None:
        """Add a remote candidate, also before the offer; returns at once."""
        if self._peer is None:
            self._early.append(candidate)
        else:
            self._peer.add_candidate(candidate)

    def path(self) -> ChosenPath | None:
        """The path that ICE chose; ``None`` before."""
        return None if self._peer is None else self._peer.path()

    async def close(self) -> None:
        self._is_closed = True
        if self._peer is not None:
            await self._peer.close()

    def _new_peer(self, offer: VettedOffer) -> AiortcPeer:
        # MAX_BUNDLE makes one transport from the start; under the default aiortc mixes them up when the data
        # channel's line comes before two video lines.
        bundle = RTCBundlePolicy.MAX_BUNDLE if offer.is_bundled else RTCBundlePolicy.BALANCED
        listener = self._listener
        peer = AiortcPeer(
            self._ice_servers,
            bundle,
            listener.candidate_found,
            listener.state_changed,
            listener.bound_exceeded,
            relay_only=self._relay_only,
            takes_loopback=listener.is_local,
        )

        peer.buffer.background = self._congestion.background
        peer.buffer.on_left = self._congestion.data_left

        @peer.pc.on("datachannel")
        def arrived(channel: RTCDataChannel) -> None:
            self._listener.channel_opened(AiortcChannel(channel, peer.buffer))

        return peer

    def _bind(self, peer: AiortcPeer, offer: VettedOffer, lines: Sequence[OfferedLine], wishes: _Wishes) -> None:
        """Give ``lines`` to the labels that have none yet."""
        bound, sound = self._allot(offer, lines, wishes)
        mids = {line.mid for line in lines}
        for transceiver in peer.pc.getTransceivers():
            if transceiver.mid not in mids:
                continue
            label = bound.get(transceiver.mid or "") or sound.bind(transceiver, offer.sdp)
            if label is None:
                prefer_codecs(transceiver, CODEC_ORDER)
                transceiver.direction = "inactive"
            else:
                self._served.add(label)
            if label is not None and transceiver.kind == "video":
                self._bind_line(transceiver, label, offer.sdp)
        lineless = [label for label in wishes.labels if label not in self._served | self._refused]
        if lineless:
            self._listener.media.tracks_unbound(lineless)

    def _allot(
        self, offer: VettedOffer, lines: Sequence[OfferedLine], wishes: _Wishes
    ) -> tuple[dict[str, str], SoundLines]:
        """Which camera, and which sound, takes which of ``lines``; whose line is refused is told."""
        pictures = lines_for_labels(lines, wishes.cameras, wishes.tracks)
        heard, talking = sound_lines(lines, wishes.sound, wishes.tracks)
        for line in offer.refused:
            label = next((given.pop(line.mid) for given in (pictures, heard, talking) if line.mid in given), None)
            if label is not None and line.offered:
                self._refused.add(label)
                self._listener.media.track_refused(label, line.cause)
        return pictures, SoundLines(heard, talking, self._listener)

    def _bind_line(self, transceiver: RTCRtpTransceiver, label: str, offer_sdp: str) -> None:
        sender, feed = transceiver.sender, self._listener.media.track_bound(label)
        prefer_codecs(transceiver, feed.codec_order or CODEC_ORDER)
        feed.codec_agreed(sent_codec(transceiver))
        has_arrivals = agree_on_arrivals(transceiver, offer_sdp)
        ssrc = ssrc_of(sender)

        def origin_known(rtp_origin: int) -> None:
            self._listener.media.origin_known(label, ssrc, rtp_origin)

        track = VideoTrack(label, feed, sender, origin_known, has_arrivals=has_arrivals, connection=self._congestion)
        sender.replaceTrack(track)
        name_stream(sender, label)
        transceiver.direction = "sendonly"


@dataclass(frozen=True, slots=True)
class _Wishes:
    """The sources that have no line yet and may be given one, and the operator's wish which (mid → label)."""

    cameras: Sequence[str]
    sound: SoundLabels
    tracks: Mapping[str, str] | None

    @property
    def labels(self) -> tuple[str, ...]:
        return (*self.cameras, *self.sound.microphones, *self.sound.speakers)


def _refused(error: Exception) -> ConnectionFailed:
    message = f"The session description was refused: {error or type(error).__name__}"
    return ConnectionFailed(message, code="sdp.invalid")
