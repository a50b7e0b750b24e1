"""Peer connections without a network: what aiortc is for a robot and an operator, in one process's memory."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping, Sequence

from mosaic_core.laboratory.impairment import Impairment
from mosaic_core.laboratory.memory_ends import MemoryChannel, MemoryVideo, MemoryVoice, memory_picture
from mosaic_core.laboratory.memory_impairment import MessageFlow
from mosaic_core.machines.laboratory.impaired_link import ImpairedLink, LinkProfile
from mosaic_core.machines.peers.chosen_path import ChosenPath
from mosaic_core.runtime.media.plain_stream import plain_sound, plain_streams
from mosaic_core.runtime.transport.media_transport import (
    NO_SOUND,
    PictureFeed,
    PictureStreamFactory,
    SoundLabels,
    SoundStreamFactory,
)
from mosaic_core.runtime.transport.operator_transport import OffererListener
from mosaic_core.runtime.transport.transport import AnswererListener
from mosaic_core.words.errors import ConnectionFailed
from mosaic_core.words.ice import IceServer
from mosaic_core.words.signaling import IceCandidate


class MemoryLink:
    """Connects an operator (the offerer) and a robot (the answerer) in memory; implements both ends."""

    def __init__(self, number: int, listener: OffererListener, impairment: Impairment | None = None) -> None:
        self.sdp = f"memory {number}"
        self.impairment = impairment or Impairment()
        self.is_cut = False
        self.lost_labels: set[str] = set()
        self._offerer = listener
        self._answerer: AnswererListener | None = None
        self._is_connected = False
        self._is_closed = False
        self._labels: list[str] = []
        self._voices: dict[str, MemoryVoice] = {}
        self._feeds: dict[str, PictureFeed] = {}
        self._shown: set[str] = set()
        self._channels: list[MemoryChannel] = []

    # -- the operator's end ------------------------------------------------------------------------------------------

    def create_channel(
        self, label: str, *, protocol: str = "", ordered: bool = True, max_retransmits: int | None = None
    ) -> MemoryChannel:
        is_reliable = ordered and max_retransmits is None
        ours, theirs = (
            MemoryChannel(self, label, protocol, is_reliable, is_first=not self._channels) for _ in range(2)
        )
        ours.other, theirs.other = theirs, ours
        ours.sent = self._flow(self.impairment.up, theirs)
        theirs.sent = self._flow(self.impairment.down, ours)
        self._channels.append(ours)
        if self._is_connected:
            asyncio.get_running_loop().call_soon(self._open, ours)
        return ours

    def _flow(self, link: ImpairedLink, to: MemoryChannel) -> MessageFlow:
        return MessageFlow(self.impairment, link, lambda: self.is_cut, to.receive, is_reliable=to.is_reliable)

    def add_video(self, label: str) -> None:
        self._labels.append(label)

    def add_microphone(self, label: str) -> None:
        self._labels.append(label)

    def add_speaker(self, label: str) -> MemoryVoice:
        voice = self._voices[label] = MemoryVoice()
        return voice

    async def offer(self) -> tuple[str, Mapping[str, str]]:
        return self.sdp, {str(line): label for line, label in enumerate(self._labels)}

    async def offer_more(self, pictures: Sequence[str]) -> tuple[str, Mapping[str, str]]:
        self._labels += pictures
        return await self.offer()

    async def accept_answer(self, sdp: str) -> None:
        if self._is_connected:
            self._show_tracks()
        else:
            asyncio.get_running_loop().call_soon(self._connect)

    async def add_candidate(self, candidate: IceCandidate) -> None:
        """There are none in memory."""

    def path(self) -> ChosenPath | None:
        """In memory there is none."""
        return None

    async def close(self) -> None:
        self._close()

    # -- the robot's end ---------------------------------------------------------------------------------------------

    def answered_by(self, listener: AnswererListener, media_labels: Sequence[str], speakers: Sequence[str] = ()) -> str:
        self._answerer = listener
        wanted = [label for label in self._labels if label in media_labels]
        self._feeds |= {label: listener.media.track_bound(label) for label in wanted if label not in self._feeds}
        for label in (label for label in self._voices if label in speakers and not self._is_connected):
            listener.media.voice_bound(label, self._voices[label])
        unbound = [label for label in (*media_labels, *speakers) if label not in (*wanted, *self._voices)]
        if unbound:
            listener.media.tracks_unbound(unbound)
        return f"{self.sdp} answered"

    def _connect(self) -> None:
        if self._is_closed or self._answerer is None:
            return
        self._is_connected = True
        self._show_tracks()
        self._answerer.state_changed("connected")
        self._offerer.state_changed("connected")
        for channel in list(self._channels):
            self._open(channel)

    def _show_tracks(self) -> None:
        for label in self._feeds.keys() - self._shown:
            self._shown.add(label)
            self._offerer.track_arrived(label, MemoryVideo(self, self._feeds[label]))

    def _open(self, ours: MemoryChannel) -> None:
        if self._is_closed or self.is_cut or self._answerer is None or ours.is_open:
            return
        assert ours.other is not None
        ours.other.is_open = True
        self._answerer.channel_opened(ours.other)
        ours.opened()

    def lose(self) -> None:
        """Break it; both ends notice."""
        self.is_cut = True
        if self._is_connected and not self._is_closed:
            self._offerer.state_changed("failed")
            if self._answerer is not None:
                self._answerer.state_changed("failed")

    def _close(self) -> None:
        if self._is_closed:
            return
        self._is_closed = True
        for channel in self._channels:
            channel.close()
        if not self.is_cut:
            self._offerer.state_changed("closed")
            if self._answerer is not None:
                self._answerer.state_changed("closed")


class MemoryAnswerer:
    """Answers the offers of one operator in memory; a ``runtime.transport.Answerer``."""

    def __init__(self, network: MemoryNetwork, listener: AnswererListener) -> None:
        self._network = network
        self._listener = listener
        self._link: MemoryLink | None = None

    async def answer(
        self,
        offer_sdp: str,
        media_labels: Sequence[str],
        tracks: Mapping[str, str] | None,
        sound: SoundLabels = NO_SOUND,
    ) -> str:
        self._link = self._network.links.get(offer_sdp)
        if self._link is None:
            raise ConnectionFailed(f"no such offer: {offer_sdp!r}", code="sdp.invalid")
        return self._link.answered_by(self._listener, (*media_labels, *sound.microphones), sound.speakers)

    async def add_candidate(self, candidate: IceCandidate) -> None:
        """There are none in memory."""

    def path(self) -> ChosenPath | None:
        """In memory there is none."""
        return None

    async def close(self) -> None:
        if self._link is not None:
            await self._link.close()


class MemoryNetwork:
    """All connections of a test. Messages and pictures are late or lost as ``profile`` says."""

    def __init__(self, profile: LinkProfile | str = "pristine", *, seed: int = 1) -> None:
        self.links: dict[str, MemoryLink] = {}
        self.open_stream: PictureStreamFactory = plain_streams(memory_picture)
        self.open_sound: SoundStreamFactory = plain_sound
        self._impairment = Impairment(profile, seed=seed)

    def offerer(self, listener: OffererListener, ice_servers: Sequence[IceServer]) -> MemoryLink:
        """Implements ``OffererFactory``."""
        link = MemoryLink(len(self.links) + 1, listener, self._impairment)
        self.links[link.sdp] = link
        return link

    def answerer(self, listener: AnswererListener, ice_servers: Sequence[IceServer]) -> MemoryAnswerer:
        """Implements ``AnswererFactory``."""
        return MemoryAnswerer(self, listener)

    @property
    def robot_ice_servers(self) -> tuple[IceServer, ...]:
        """There are none in memory."""
        return ()

    def become(self, profile: LinkProfile | str) -> None:
        """Another network from now on, both ways."""
        self._impairment.become(profile)

    def cut(self) -> None:
        """From now on nothing arrives anywhere, and nobody is told: a cable was pulled."""
        for link in self.links.values():
            link.is_cut = True

    def heal(self) -> None:
        """The cable is back."""
        for link in self.links.values():
            link.is_cut = False

    def lose(self) -> None:
        """The same, and both ends notice it now. Connections that are made anew work."""
        for link in list(self.links.values()):
            link.lose()
