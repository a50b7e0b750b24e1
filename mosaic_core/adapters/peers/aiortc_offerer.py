"""The operator's side of a peer connection over aiortc: channels at any time, media lines before the offer."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence

from aiortc import MediaStreamTrack, RTCBundlePolicy, RTCRtpTransceiver, RTCSessionDescription

from mosaic_core.adapters.aiortc_private.rtp.receivers import route_repeats
from mosaic_core.adapters.aiortc_private.rtp.reporting import ArrivalReporter, agreed_number_id, offer_reports
from mosaic_core.adapters.peers.aiortc_channel import AiortcChannel
from mosaic_core.adapters.peers.aiortc_peer import AiortcPeer
from mosaic_core.adapters.peers.description_bounds import refuse_beyond_bounds
from mosaic_core.adapters.peers.offer_vetting import refuse_unless_bundled, separated_candidates, with_fragments
from mosaic_core.adapters.sound.sound_track import OutgoingVoice, ReceivedSound, SoundTrack
from mosaic_core.adapters.video.incoming_video import AiortcVideo
from mosaic_core.contract.sound import SoundEncoding
from mosaic_core.machines.peers.chosen_path import ChosenPath
from mosaic_core.runtime.transport.operator_transport import OffererListener
from mosaic_core.words.errors import ConnectionFailed
from mosaic_core.words.ice import IceServer
from mosaic_core.words.signaling import IceCandidate

_log = logging.getLogger(__name__)


class AiortcOfferer:
    """Makes a peer connection that this side offers."""

    def __init__(
        self, listener: OffererListener, ice_servers: Sequence[IceServer], *, relay_only: bool = False
    ) -> None:
        self._listener = listener
        self._peer = AiortcPeer(
            ice_servers,
            RTCBundlePolicy.MAX_BUNDLE,
            listener.candidate_found,
            listener.state_changed,
            self._bound_exceeded,
            relay_only=relay_only,
        )
        self._labels: list[str] = []
        self._tracks: dict[str, str] = {}
        self._named: dict[str, str] = {}
        self._is_answered = False
        self._reporter: ArrivalReporter | None = None
        self._peer.pc.on("track", self._track_arrived)

    def create_channel(
        self, label: str, *, protocol: str = "", ordered: bool = True, max_retransmits: int | None = None
    ) -> AiortcChannel:
        """Open a data channel; one that comes after the connection needs no renegotiation."""
        channel = self._peer.pc.createDataChannel(
            label, protocol=protocol, ordered=ordered, maxRetransmits=max_retransmits
        )
        return AiortcChannel(channel, self._peer.buffer)

    def add_video(self, label: str) -> None:
        """Add a line to receive ``label`` on; only before the first channel and :meth:`offer`.

        The order matters: what is made first owns the one transport, and in the offer video lines come first.
        """
        self._add_line("video", "recvonly", label)

    def add_microphone(self, label: str) -> None:
        """The same for sound; after the video lines."""
        self._add_line("audio", "recvonly", label)

    def add_speaker(self, label: str) -> OutgoingVoice:
        """Add a line to talk on; after the video lines."""
        voice = OutgoingVoice(SoundEncoding().bitrate_bps)
        self._add_line("audio", "sendonly", label).sender.replaceTrack(SoundTrack(label, voice.feed))
        return voice

    def _bound_exceeded(self, why: str) -> None:
        _log.warning("the robot's connection is given up, it sends too much: %s (channel.too_large)", why)
        self._listener.state_changed("failed")

    def _add_line(self, kind: str, direction: str, label: str) -> RTCRtpTransceiver:
        if self._peer.pc.sctp is not None or self._tracks:
            raise ConnectionFailed("Media lines come before the first channel.", code="sdp.invalid")
        self._labels.append(label)
        return self._peer.pc.addTransceiver(kind, direction=direction)

    async def offer(self) -> tuple[str, Mapping[str, str]]:
        """The offer's SDP at once, and which label each media line is for (mid → label). Candidates follow."""
        return self._offered(await self._peer.describe_locally())

    async def offer_more(self, pictures: Sequence[str]) -> tuple[str, Mapping[str, str]]:
        """A further offer on the live connection, with lines to receive these on too; all tracks as :meth:`offer`."""
        for label in pictures:
            self._labels.append(label)
            self._peer.pc.addTransceiver("video", direction="recvonly")
        return self._offered(await self._peer.describe_again())

    def _offered(self, sdp: str) -> tuple[str, Mapping[str, str]]:
        mids = [transceiver.mid or "" for transceiver in self._peer.pc.getTransceivers()]
        self._tracks = dict(zip(mids, self._labels, strict=True))
        return offer_reports(sdp), self._tracks

    async def accept_answer(self, sdp: str) -> None:
        """Apply the robot's answer; raises :class:`ConnectionFailed` (``sdp.invalid``)."""
        refuse_beyond_bounds(sdp)
        text, candidates, has_all = separated_candidates(with_fragments(sdp))
        refuse_unless_bundled(text)
        self._named = named_lines(text)
        try:
            await self._peer.pc.setRemoteDescription(RTCSessionDescription(text, "answer"))
        except self._peer.ERRORS as error:
            message = f"The robot's answer was refused: {error or type(error).__name__}"
            raise ConnectionFailed(message, code="sdp.invalid") from error
        route_repeats(self._peer.pc)
        self._report_arrivals(text)
        if not self._is_answered:
            self._is_answered = True
            self._peer.described_remotely(candidates, has_all)

    async def add_candidate(self, candidate: IceCandidate) -> None:
        """Add a remote candidate, also before the answer."""
        self._peer.add_candidate(candidate)

    def path(self) -> ChosenPath | None:
        return self._peer.path()

    async def close(self) -> None:
        await self._peer.close()

    def _report_arrivals(self, answer_sdp: str) -> None:
        """If the robot numbers its packets, from the first one on."""
        number_id = agreed_number_id(answer_sdp)
        if number_id is not None and self._reporter is None:
            line = next(one for one in self._peer.pc.getTransceivers() if one.kind == "video")
            self._reporter = ArrivalReporter(line, number_id)

    def _track_arrived(self, track: MediaStreamTrack) -> None:
        line = next((one for one in self._peer.pc.getTransceivers() if one.receiver.track is track), None)
        mid = "" if line is None else line.mid or ""
        # an original robot may give a line to another camera than we wished; who names none, the line tells
        label = self._named.get(mid) or (track.id if track.id in self._labels else self._tracks.get(mid, track.id))
        if track.kind == "audio":
            self._listener.track_arrived(label, ReceivedSound(track))
            return
        self._listener.track_arrived(label, AiortcVideo(track, line.receiver if line is not None else None))


def named_lines(sdp: str) -> dict[str, str]:
    """Mid → label, of the lines of an answer that name one. MOSAIC's robots write it into the line's ``msid``, as name
    of the stream and of the track: ``a=msid:front front``. Others write something else there, and then only the line
    itself tells."""
    named: dict[str, str] = {}
    for section in sdp.split("\nm=")[1:]:
        told = [line.strip()[2:] for line in section.splitlines() if line.startswith(("a=mid:", "a=msid:"))]
        values = dict(line.split(":", 1) for line in told)
        stream, _, track = values.get("msid", "").partition(" ")
        if stream and stream == track.strip() and "mid" in values:
            named[values["mid"]] = stream
    return named
