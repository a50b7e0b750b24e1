"""The robot's side of a peer connection over aiortc: vet the offer, bind tracks to its lines, answer at once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from aiortc import (
    RTCBundlePolicy,
    RTCDataChannel,
    RTCRtpTransceiver,
    RTCSessionDescription,
)

from mosaic_core.adapters.aiortc_channel import AiortcChannel
from mosaic_core.adapters.aiortc_peer import AiortcPeer
from mosaic_core.adapters.aiortc_private import agree_on_arrivals, name_stream, prefer_codecs, sent_codec, ssrc_of
from mosaic_core.adapters.offer_vetting import VettedOffer, lines_for_labels, sound_lines, vetted_offer
from mosaic_core.adapters.sound_lines import SoundLines
from mosaic_core.adapters.video_track import VideoTrack
from mosaic_core.machines.chosen_path import ChosenPath
from mosaic_core.runtime.sound_transport import NO_SOUND, SoundLabels
from mosaic_core.runtime.transport import AnswererListener
from mosaic_core.words.errors import ConnectionFailed
from mosaic_core.words.ice import IceServer
from mosaic_core.words.signaling import IceCandidate

CODEC_ORDER = ("video/VP8", "video/H264")
"""Of what a feed does not care about."""


class AiortcAnswerer:
    """Implements ``runtime.transport.Answerer`` for one operator."""

    def __init__(
        self, listener: AnswererListener, ice_servers: Sequence[IceServer], *, relay_only: bool = False
    ) -> None:
        self._listener = listener
        self._relay_only = relay_only
        self._ice_servers = ice_servers
        self._peer: AiortcPeer | None = None
        self._early: list[IceCandidate] = []
        self._is_closed = False

    async def answer(
        self,
        offer_sdp: str,
        media_labels: Sequence[str],
        tracks: Mapping[str, str] | None,
        sound: SoundLabels = NO_SOUND,
    ) -> str:
        """See :class:`mosaic_core.runtime.transport.Answerer`. Adds ``ice.no_address`` and ``ice.no_relay``."""
        if self._peer is not None or self._is_closed:
            raise ConnectionFailed("This peer connection has had its offer.", code="sdp.invalid")
        offer = vetted_offer(offer_sdp)
        bound = lines_for_labels(offer.lines, media_labels, tracks)
        heard, spoken = sound_lines(offer.lines, sound, tracks)
        peer = self._peer = self._new_peer(offer)
        try:
            await peer.pc.setRemoteDescription(RTCSessionDescription(offer.sdp, "offer"))
        except peer.ERRORS as error:
            message = f"The session description was refused: {error or type(error).__name__}"
            raise ConnectionFailed(message, code="sdp.invalid") from error
        served = self._bind(peer, bound, SoundLines(heard, spoken, self._listener), offer.sdp)
        unbound = [label for label in (*media_labels, *sound.microphones, *sound.speakers) if label not in served]
        if unbound:
            self._listener.tracks_unbound(unbound)
        sdp = await peer.describe_locally()
        peer.described_remotely((*offer.candidates, *self._early), offer.has_all_candidates)
        self._early.clear()
        return sdp

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
            self._ice_servers, bundle, listener.candidate_found, listener.state_changed, relay_only=self._relay_only
        )

        @peer.pc.on("datachannel")
        def arrived(channel: RTCDataChannel) -> None:
            self._listener.channel_opened(AiortcChannel(channel, peer.buffer))

        return peer

    def _bind(self, peer: AiortcPeer, bound: Mapping[str, str], sound: SoundLines, offer_sdp: str) -> set[str]:
        """The labels that have a line now."""
        served: set[str] = set()
        for transceiver in peer.pc.getTransceivers():
            label = bound.get(transceiver.mid or "") or sound.bind(transceiver)
            if label is None:
                prefer_codecs(transceiver, CODEC_ORDER)
                transceiver.direction = "inactive"
            else:
                served.add(label)
            if label is not None and transceiver.kind == "video":
                self._bind_line(transceiver, label, offer_sdp)
        return served

    def _bind_line(self, transceiver: RTCRtpTransceiver, label: str, offer_sdp: str) -> None:
        sender, feed = transceiver.sender, self._listener.track_bound(label)
        prefer_codecs(transceiver, feed.codec_order or CODEC_ORDER)
        feed.codec_agreed(sent_codec(transceiver))
        has_arrivals = agree_on_arrivals(transceiver, offer_sdp)
        ssrc = ssrc_of(sender)

        def origin_known(rtp_origin: int) -> None:
            self._listener.origin_known(label, ssrc, rtp_origin)

        sender.replaceTrack(VideoTrack(label, feed, sender, origin_known, has_arrivals=has_arrivals))
        name_stream(sender, label)
        transceiver.direction = "sendonly"


def aiortc_answerer(
    listener: AnswererListener, ice_servers: Sequence[IceServer], *, relay_only: bool = False
) -> AiortcAnswerer:
    """An ``AnswererFactory``."""
    return AiortcAnswerer(listener, ice_servers, relay_only=relay_only)
