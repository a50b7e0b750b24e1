"""A media track that takes its pictures from the runtime: nothing is encoded until the feed has one."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import Any

from aiortc import RTCRtpSender
from aiortc.mediastreams import MediaStreamError, MediaStreamTrack

from mosaic_core.adapters.aiortc_private import RtpOriginLearner
from mosaic_core.adapters.picture import own_frame
from mosaic_core.runtime.transport import PictureFeed

_log = logging.getLogger(__name__)


class VideoTrack(MediaStreamTrack):
    """One camera for one operator. Its ``id`` is the connector's label, so that ``msid`` names it.

    ``on_origin(rtp_origin)`` is called once, after the first picture has left.
    """

    kind = "video"

    def __init__(self, label: str, feed: PictureFeed, sender: RTCRtpSender, on_origin: Callable[[int], None]) -> None:
        super().__init__()
        self._label = label
        self._feed = feed
        self._origin: RtpOriginLearner | None = RtpOriginLearner(sender)
        self._on_origin = on_origin
        self._last_pts = -1
        self._has_warned = False

    @property
    def id(self) -> str:
        return self._label

    async def recv(self) -> Any:
        """Wait for the next picture. The sender asks again only after it has sent the previous one."""
        self._learn_origin()
        while self.readyState == "live":
            prepared = await self._feed.next()
            if prepared.pts is not None and prepared.pts > self._last_pts:
                self._last_pts = prepared.pts
                return own_frame(prepared)
            self._warn_once()
        raise MediaStreamError

    def _learn_origin(self) -> None:
        if self._origin is None or self._last_pts < 0:
            return
        origin = self._origin.learn(self._last_pts)
        if origin is not None:
            self._origin = None
            self._on_origin(origin)

    def _warn_once(self) -> None:
        if not self._has_warned:
            self._has_warned = True
            _log.warning("%s: a picture was captured no later than the one before it and is left out", self._label)
