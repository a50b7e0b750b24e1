"""Gives the audio lines of an offer to microphones and loudspeakers; a line without Opus stays empty."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from aiortc import RTCRtpTransceiver

from mosaic_core.adapters.aiortc_private.rtp.codecs import prefer_codecs, sent_codec
from mosaic_core.adapters.aiortc_private.rtp.packet_arrivals import agree_on_arrivals
from mosaic_core.adapters.aiortc_private.rtp.senders import name_stream
from mosaic_core.runtime.transport.media_transport import OPUS
from mosaic_core.runtime.transport.transport import AnswererListener


@dataclass(frozen=True, slots=True)
class SoundLines:
    """The microphones and loudspeakers of an offer by its media lines. ``heard``: mid → microphone, ``spoken``: mid →
    loudspeaker.
    """

    heard: Mapping[str, str]
    spoken: Mapping[str, str]
    listener: AnswererListener

    def bind(self, transceiver: RTCRtpTransceiver, offer_sdp: str) -> str | None:
        """The label that has the line now."""
        mid = transceiver.mid or ""
        label = self.heard.get(mid) or self.spoken.get(mid)
        if label is None:
            return None
        prefer_codecs(transceiver, (OPUS,))
        if sent_codec(transceiver).lower() != OPUS:
            return None
        # Only now: a robot without sound, which has an answerer like all others, needs no NumPy for it.
        from mosaic_core.adapters.sound.sound_track import AiortcIncomingSound, SoundTrack

        if mid in self.heard:
            feed = self.listener.media.track_bound(label)
            feed.codec_agreed(OPUS)
            track = SoundTrack(label, feed)
            if agree_on_arrivals(transceiver, offer_sdp):
                track.count_in(self.listener.congestion, transceiver.sender)
            transceiver.sender.replaceTrack(track)
            name_stream(transceiver.sender, label)
            transceiver.direction = "sendonly"
        else:
            transceiver.direction = "recvonly"
            self.listener.media.voice_bound(label, AiortcIncomingSound(transceiver.receiver.track))
        return label
