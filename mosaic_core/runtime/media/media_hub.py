"""Pictures and sound from the handlers to the peers: one stream per label, and who watches it.

Nobody watching: nothing is converted or encoded, and a ``watched`` handler does not run.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import cast

from mosaic_core.contract.media import Captured, EncodingParams, PacketCodec, Picture
from mosaic_core.contract.sound import Sound, SoundEncoding
from mosaic_core.runtime.media.plain_stream import plain_sound
from mosaic_core.runtime.observation.counters import ConnectorCounters
from mosaic_core.runtime.transport.media_transport import (
    PictureFeed,
    PictureStream,
    PictureStreamFactory,
    SoundStream,
    SoundStreamFactory,
    TellUnavailable,
)

Look = Callable[[Captured], None]
"""Shown a picture on the thread of its camera."""


class MediaHub:
    """Hands pictures and sound of one robot to whoever watches. ``watched``: told on the loop when a label gets its
    first or loses its last viewer.
    """

    def __init__(
        self,
        open_stream: PictureStreamFactory,
        watched: Callable[[str, bool], None],
        open_sound: SoundStreamFactory = plain_sound,
    ) -> None:
        self._open_stream = open_stream
        self._open_sound = open_sound
        self._watched = watched
        self._pictures: dict[str, PictureStream] = {}
        self._sounds: dict[str, SoundStream] = {}
        self._streams: dict[str, PictureStream | SoundStream] = {}
        self._bound: set[tuple[str, str]] = set()
        self._viewers: dict[str, frozenset[str]] = {}
        self._looks: dict[str, dict[str, Look]] = {}  # the inner ones are replaced: handlers' threads read them

    def add_label(
        self,
        label: str,
        encoding: EncodingParams,
        counters: ConnectorCounters,
        packet_codec: PacketCodec | None = None,
    ) -> None:
        self._streams[label] = self._pictures[label] = self._open_stream(label, encoding, counters, packet_codec)
        self._viewers[label] = frozenset()

    def add_microphone(self, label: str, encoding: SoundEncoding, counters: ConnectorCounters) -> None:
        self._streams[label] = self._sounds[label] = self._open_sound(label, encoding, counters)
        self._viewers[label] = frozenset()

    def remove_label(self, label: str) -> None:
        """Nothing is shown there any more; its tracks fall silent. Event loop."""
        for viewer_id in self._viewers.get(label, frozenset()):
            self.watch(viewer_id, label, False)
        self._viewers.pop(label, None)
        self._pictures.pop(label, None)
        self._sounds.pop(label, None)
        self._looks.pop(label, None)
        self._bound = {bound for bound in self._bound if bound[1] != label}
        stream = self._streams.pop(label, None)
        if stream is not None:
            stream.close()

    def offer(self, label: str, item: Picture | Sound) -> bool:
        """Any thread; converts here. ``False`` if nobody watches or listens. Raises what the conversion raises."""
        if not self._viewers.get(label):
            return False
        sound = self._sounds.get(label)
        if sound is not None:
            return sound.offer(cast("Sound", item))
        picture = cast("Picture", item)
        captured = picture if isinstance(picture, Captured) else Captured(picture, time.monotonic())
        stream = self._pictures.get(label)
        is_sent = stream is not None and stream.offer(captured)
        looks = self._looks.get(label)
        if not looks:
            return is_sent
        for look in looks.values():
            look(captured)
        return True

    # -- on the event loop ---------------------------------------------------------------------------------------

    def bind(self, peer_id: str, label: str, unavailable: TellUnavailable, *, is_local: bool = False) -> PictureFeed:
        """The peer has a track for ``label``; its feed is silent until :meth:`watch`. ``unavailable`` is told why no
        picture can come. ``is_local``: a tap on this robot."""
        self._bound.add((peer_id, label))
        return self._streams[label].bind(peer_id, unavailable, is_local=is_local)

    def is_bound(self, peer_id: str, label: str) -> bool:
        return (peer_id, label) in self._bound

    def watch(self, peer_id: str, label: str, on: bool) -> None:
        """Let pictures of ``label`` flow to the peer, or stop them."""
        before = self._viewers[label]
        after = before | {peer_id} if on else before - {peer_id}
        if after == before:
            return
        self._viewers[label] = after
        self._streams[label].watch(peer_id, on)
        if bool(before) != bool(after):
            self._watched(label, bool(after))

    def look(self, viewer_id: str, label: str, look: Look) -> None:
        """Watch ``label`` on this robot, before anything is encoded."""
        self._looks[label] = {**self._looks.get(label, {}), viewer_id: look}
        self.watch(viewer_id, label, True)

    def leave(self, peer_id: str) -> None:
        for label in self._viewers:
            self.watch(peer_id, label, False)
            self._streams[label].leave(peer_id)
        for label, looks in self._looks.items():
            self._looks[label] = {viewer_id: look for viewer_id, look in looks.items() if viewer_id != peer_id}
        self._bound = {bound for bound in self._bound if bound[0] != peer_id}

    def close(self) -> None:
        for stream in self._streams.values():
            stream.close()

    def labels(self) -> tuple[str, ...]:
        """All of them: those of pictures, then those of sound."""
        return tuple(self._viewers)

    def cameras(self) -> tuple[str, ...]:
        """In the order of the YAML file."""
        return tuple(self._pictures)

    def microphones(self) -> tuple[str, ...]:
        """In the order of the YAML file."""
        return tuple(self._sounds)

    def viewers(self, label: str) -> int:
        return len(self._viewers.get(label, ()))

    def watched_by(self, peer_id: str) -> tuple[str, ...]:
        return tuple(label for label, viewers in self._viewers.items() if peer_id in viewers)
