"""Manages the pictures and sound of one operator: its lines for pictures, sound and voice, and what it is told of
them."""

from __future__ import annotations

import logging
from collections.abc import Collection, Sequence

from mosaic_core.contract.host import Sender
from mosaic_core.runtime.media.plain_stream import NewestFeed
from mosaic_core.runtime.peers.peer_timeline import PeerTimeline
from mosaic_core.runtime.peers.remote_operator import RemoteOperator
from mosaic_core.runtime.peers.site import Site
from mosaic_core.runtime.transport.media_transport import IncomingSound, PictureFeed
from mosaic_core.words import control

logger = logging.getLogger(__name__)

NO_COMMON_CODEC = "sdp.no_common_codec"


class PeerMedia:
    """Binds the media lines of one operator, and tells it what becomes of them. Event loop only."""

    def __init__(self, operator: RemoteOperator, site: Site, timeline: PeerTimeline) -> None:
        self._operator = operator
        self._peer_id = operator.peer_id
        self._site = site
        self._timeline = timeline
        self._unbound: list[str] = []
        self._refused: dict[str, str] = {}
        self._origins: list[control.MediaOrigin] = []
        self._is_greeted = False
        self._has_left = False
        self._feeds: dict[str, PictureFeed] = {}
        self._voices: set[str] = set()

    # -- the lines of its offers ---------------------------------------------------------------------------------

    def track_bound(self, label: str) -> PictureFeed:
        """It has a line for the camera or microphone ``label``."""
        if self._has_left:  # while its offer was being answered: nobody would unbind this one
            return NewestFeed()
        self._refused.pop(label, None)
        feed = self._site.media.bind(self._peer_id, label, lambda code: self._unavailable(label, code))
        self._feeds[label] = feed
        return feed

    def voice_bound(self, label: str, sound: IncomingSound) -> None:
        """It has a line for its voice to the loudspeaker ``label``."""
        if self._has_left:
            sound.stop()
        else:
            self._voices.add(label)
            self._site.talk.bind(self._operator, label, sound)

    def has_lines(self, labels: Collection[str]) -> bool:
        """Whether it has a line for one of these cameras, microphones or loudspeakers."""
        return any(label in self._feeds or label in self._voices for label in labels)

    def tracks_unbound(self, labels: Sequence[str]) -> None:
        self._unbound = list(labels)

    def track_refused(self, label: str, cause: str) -> None:
        """Its line for ``label`` is refused; an original operator sees only that, and whoever reads the log."""
        fields = {"peerId": self._peer_id, "label": label, "code": NO_COMMON_CODEC}
        text = "%s can't be sent to operator %s: %s (%s)"
        logger.warning(text, label, self._operator.name, cause, NO_COMMON_CODEC, extra=fields)
        self._refused[label] = cause
        if self._is_greeted:
            self._tell_refused(label)

    def _tell_refused(self, label: str) -> None:
        message = control.MediaUnavailable(label=label, code=NO_COMMON_CODEC, message=self._refused[label])
        self._operator.answer(message)

    def origin_known(self, label: str, ssrc: int, rtp_origin: int) -> None:
        """The first picture of ``label`` leaves; how its time stamps are read."""
        origin = control.MediaOrigin(label=label, ssrc=ssrc, rtp_origin=rtp_origin, boot_id=self._site.boot_id)
        self._timeline.frame_sent(label)
        self._origins = [known for known in self._origins if known.label != label] + [origin]
        if self._is_greeted and not self._has_left:
            self._operator.answer(origin)

    # -- who it turns out to be ----------------------------------------------------------------------------------

    def operator_greeted(self) -> None:
        """It speaks our words: tell it what was found out before it could listen."""
        self._is_greeted = True
        for origin in self._origins:
            self._operator.answer(origin)
        for label in self._unbound:
            self._unavailable(label, "media.no_line")
        for label in self._refused:
            self._tell_refused(label)
        for label, who in self._site.talk.talking().items():
            self.talking_changed(label, who)

    def show_all(self) -> None:
        """It can't say what it wants to see."""
        for label in self._site.media.labels():
            if self._site.media.is_bound(self._peer_id, label):
                self._site.media.watch(self._peer_id, label, True)

    def show_nothing(self) -> None:
        """It will say what it wants to see."""
        for label in self._site.media.watched_by(self._peer_id):
            self._site.media.watch(self._peer_id, label, False)

    def operator_left(self) -> None:
        self._has_left = True
        self._site.media.leave(self._peer_id)
        self._site.talk.leave(self._peer_id)

    # -- from then on --------------------------------------------------------------------------------------------

    def watch(self, wish: control.MediaWatch) -> None:
        """It wants to see or hear something, or does not any more, or shows it at another size."""
        media, label, on = self._site.media, wish.label, wish.on
        is_bound = media.is_bound(self._peer_id, label)
        if on and not is_bound and label in self._refused:
            self._tell_refused(label)
        elif on and not is_bound:
            self._unavailable(label, "media.no_line" if label in media.labels() else "channel.unknown_label")
        elif label in media.labels() and not self._has_left:
            if on:
                self._feeds[label].shown(wish.shown_px, leads=bool(wish.leads))
            if on != (label in media.watched_by(self._peer_id)):
                self._timeline.watched(label, on and label in media.cameras())
            media.watch(self._peer_id, label, on)
            if not on and self._operator.link is not None:
                self._operator.link.picture_unwatched(label)

    def talking_changed(self, label: str, who: Sender | None) -> None:
        """Somebody talks to the loudspeaker ``label``, or nobody does any more."""
        known = {} if who is None else {"peer_id": who.peer_id, "name": who.name}
        self._operator.tell(control.MediaTalking(label=label, **known))

    def _unavailable(self, label: str, code: str) -> None:
        self._operator.answer(control.MediaUnavailable(label=label, code=code))
