"""Shows a robot's cameras to one viewer, without server and catalogue: an ``AnswererListener`` for benches."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

from mosaic_core.runtime.transport.peer_congestion import PeerCongestion


class CameraListener:
    """Binds each line to the camera of its label. All of ``streams`` but the ``later`` ones are watched as soon as the
    viewer is connected."""

    is_local = True

    def __init__(self, streams: Mapping[str, Any], viewer: str = "page", later: Collection[str] = ()) -> None:
        self.media = self
        self.congestion = PeerCongestion()
        self._streams, self._viewer, self._later = streams, viewer, later

    def watch(self, label: str) -> None:
        self._streams[label].watch(self._viewer, True)

    def track_bound(self, label: str) -> Any:
        return self._streams[label].bind(self._viewer, print)

    def state_changed(self, state: str) -> None:
        if state == "connected":
            for label in self._streams.keys() - self._later:
                self.watch(label)

    def bound_exceeded(self, why: str) -> None: ...
    def candidate_found(self, candidate: Any) -> None: ...
    def channel_opened(self, channel: Any) -> None: ...
    def tracks_unbound(self, labels: Any) -> None: ...
    def track_refused(self, label: str, cause: str) -> None: ...
    def voice_bound(self, label: str, sound: Any) -> None: ...
    def origin_known(self, label: str, ssrc: int, rtp_origin: int) -> None: ...
