"""Joins the stores of pictures and sound with the tracks of the peer connection."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeGuard

from mosaic_core.machines.media.first_frame import FIRST_FRAME_TIMEOUT_S, first_frame_code
from mosaic_core.operator.control.control_desk import ControlDesk
from mosaic_core.operator.control.picture_reports import PictureReports
from mosaic_core.operator.peers.connection_plan import ConnectionPlan
from mosaic_core.operator.peers.further_offers import FurtherOffers
from mosaic_core.operator.peers.peer_attempt import PeerAttempt
from mosaic_core.operator.stores.channel_plan import Known, sound_store
from mosaic_core.operator.stores.media_store import MediaStreamStore, SoundStore, VoiceStore
from mosaic_core.operator.stores.mosaic_store import MosaicStore
from mosaic_core.runtime.transport.operator_transport import IncomingVideo
from mosaic_core.words import control
from mosaic_core.words.codes import REASONS, reason
from mosaic_core.words.errors import ConnectionFailed

NO_LINE = "The connection was made without a media line for this connector; connect again to use it."
LATE_FOR_ORIGINAL = "An original robot takes no further camera on a live connection."
LATE_CURE = "Name it in connect(connectors=[…]), or allow a short break: connect(may_break=True)."
IS_SOUND = "This connector is sound: make its store once the robot's catalogue is known."

MediaStore = MediaStreamStore | SoundStore | VoiceStore


def is_media_store(store: MosaicStore) -> TypeGuard[MediaStore]:
    """Whether the store has a track, and no channels."""
    return isinstance(store, MediaStreamStore | SoundStore | VoiceStore)


class MediaBindings:
    """Shows tracks in their stores, asks for lines that are missing, and says why nothing comes. Event loop only.

    ``make_anew(label)``: whether the connection is made anew, with a line for this picture, for a robot that takes no
    further offer.
    """

    def __init__(
        self, peer: PeerAttempt, plan: ConnectionPlan, desk: ControlDesk, make_anew: Callable[[str], bool]
    ) -> None:
        self.further_offers = FurtherOffers(peer.offerer, peer.say, self._lines_settled)
        self._peer = peer
        self._plan = plan
        self._make_anew = make_anew
        self._known = Known(None)
        self._stores: dict[str, MediaStore] = {}
        self._videos: dict[str, tuple[IncomingVideo, asyncio.Task[None]]] = {}
        self._lineless: set[str] = set()
        self._talkers: dict[str, str | None] = {}
        self._first_frames = FirstFrameWatch()
        self._pictures = PictureReports(desk.picture_seen, peer.control.robot_now_us, plan.clock_us)

    def start(self, known: Known) -> None:
        """The connection is up; this is what is known of the robot."""
        self._known = known

    def open(self, store: MediaStore) -> None:
        """Show the track of ``store``, or lend it the line to talk on."""
        self._stores[_label(store)] = store
        if isinstance(store, VoiceStore):
            self._lend_voice(store)
        else:
            self._show(store)

    def release(self, store: MediaStore) -> None:
        """Nobody uses it any more: the robot need not send."""
        label = _label(store)
        if self._stores.get(label) is not store:
            return
        del self._stores[label]
        if not isinstance(store, VoiceStore):
            self._stop_watching(store)
            self._first_frames.ended(label)
        store.closed()

    def track_arrived(self, label: str, video: IncomingVideo) -> None:
        """Take its frames from now on, whether anybody looks or not: left alone they would fill the memory."""
        self._videos[label] = (video, asyncio.create_task(self._take(label, video)))
        self._lines_settled(label)

    def heard(self, message: control.ControlMessage) -> None:
        """What the robot says of its pictures and sound."""
        match message:
            case control.RenegotiateAnswer():
                self.further_offers.answered(message)
            case control.MediaOrigin(label=label, rtp_origin=origin):
                self._pictures.origin_known(label, origin)
            case control.MediaTalking(label=label, peer_id=peer_id, name=name):
                self._talking_changed(label, None if peer_id is None else name)
            case control.MediaUnavailable(label=label, code=code, message=text) if label in self._stores:
                known = code if code in REASONS else "media.no_line"
                failure = ConnectionFailed(text or reason(known).sentence, code=known)
                self._first_frames.refused(label, self._stores[label], failure)
            case _:
                pass

    def close(self, *, comes_back: bool) -> None:
        """The connection is gone; the stores wait for the next one."""
        self.further_offers.close()
        for store in tuple(self._stores.values()):
            if isinstance(store, MediaStreamStore):
                store.connect_shown(None)
            store.disconnected(comes_back=comes_back)
        self._stores.clear()
        self._first_frames.close()
        for video, task in self._videos.values():
            task.cancel()
            video.stop()
        self._videos.clear()

    def _lend_voice(self, store: VoiceStore) -> None:
        label = _label(store)
        if label not in self._peer.voices:
            store.failed(ConnectionFailed(NO_LINE, code="media.no_line"))
            return
        store.connect_line(self._peer.voices[label])
        store.talking_changed(self._talkers.get(label))
        store.opened()

    def _talking_changed(self, label: str, name: str | None) -> None:
        self._talkers[label] = name
        store = self._stores.get(label)
        if isinstance(store, VoiceStore):
            store.talking_changed(name)

    def _show(self, store: MediaStreamStore | SoundStore) -> None:
        label = _label(store)
        catalogue = self._known.catalogue
        is_sound = catalogue is not None and sound_store(store.robot_connector, catalogue) is not None
        if is_sound != isinstance(store, SoundStore):
            store.failed(ConnectionFailed(IS_SOUND, code="channel.unknown_label", cure=""))
            return
        if label not in self._videos:
            if not is_sound and self.further_offers.want(label):
                self._lineless.add(label)
            elif is_sound or not self._make_anew(label):
                store.failed(self._no_line(label))
            return
        self._watch(store)
        store.opened()
        if isinstance(store, MediaStreamStore):
            store.connect_shown(lambda: self._watch(store))
            self._first_frames.began(label, store, self._videos[label][0])

    def _lines_settled(self, *labels: str) -> None:
        """The lines of these pictures, or of all that wait for one, are there, or will never be."""
        for label in self._lineless & set(labels or self._lineless):
            self._lineless.discard(label)
            store = self._stores.get(label)
            if isinstance(store, MediaStreamStore):
                self._show(store)

    def _no_line(self, label: str) -> ConnectionFailed:
        if not self._known.is_told:
            return ConnectionFailed(NO_LINE, code="media.no_line")
        if label not in self._plan.media_labels:
            return ConnectionFailed(LATE_FOR_ORIGINAL, code="media.no_line", cure=LATE_CURE)
        sends = ", ".join(map(repr, self._videos)) or "no picture at all"
        message = f"The robot gave none of its cameras the line of {label!r}; it sends {sends}."
        cure = "An original robot gives them out in the order of its file: name all that come before."
        return ConnectionFailed(message, code="media.no_line", cure=cure)

    def _watch(self, store: MediaStreamStore | SoundStore) -> None:
        shown = store.shown if isinstance(store, MediaStreamStore) else None
        size_px, leads = (None, None) if shown is None else (shown.size_px, shown.leads)
        self._say(control.MediaWatch(label=_label(store), on=True, shown_px=size_px, leads=leads))

    def _stop_watching(self, store: MediaStreamStore | SoundStore) -> None:
        if isinstance(store, MediaStreamStore):
            store.connect_shown(None)
        self._say(control.MediaWatch(label=_label(store), on=False))

    def _say(self, wish: control.MediaWatch) -> None:
        if self._peer.is_ours:
            self._peer.say(wish)

    async def _take(self, label: str, video: IncomingVideo) -> None:
        while (frame := await video.next()) is not None:
            store = self._stores.get(label)
            if isinstance(store, MediaStreamStore):
                self._first_frames.arrived(label)
                store.frame_arrived(frame)
                self._plan.timeline.mark("frame", time.monotonic(), label)
                self._pictures.shown(label, video.rtp_timestamp(frame))
            elif isinstance(store, SoundStore):
                self._first_frames.arrived(label)
                store.sound_arrived(frame)


def _label(store: MosaicStore) -> str:
    return store.robot_connector.connector_id


@dataclass(slots=True)
class _Waiting:
    store: MosaicStore
    task: asyncio.Task[None] | None = None
    """What looks once more in some seconds; ``None`` where the robot has said why already."""
    has_failed: bool = False

    def cancel(self) -> None:
        if self.task is not None:
            self.task.cancel()


class FirstFrameWatch:
    """Tells the store of a camera or microphone why nothing comes: the robot said so, or some seconds have passed since
    it was opened. What comes after all takes that back. Event loop only."""

    def __init__(self, timeout_s: float = FIRST_FRAME_TIMEOUT_S) -> None:
        self._timeout_s = timeout_s
        self._waiting: dict[str, _Waiting] = {}

    def began(self, label: str, store: MosaicStore, video: IncomingVideo) -> None:
        """The robot was asked for pictures."""
        self.ended(label)
        self._waiting[label] = _Waiting(store, asyncio.create_task(self._wait(label, video)))

    def refused(self, label: str, store: MosaicStore, failure: ConnectionFailed) -> None:
        """The robot said why nothing comes."""
        self.ended(label)
        self._waiting[label] = _Waiting(store, has_failed=True)
        store.failed(failure)

    def arrived(self, label: str) -> None:
        """A picture or a piece of sound: cheap, called with every one."""
        if label in self._waiting:
            waiting = self._waiting.pop(label)
            waiting.cancel()
            if waiting.has_failed:
                waiting.store.opened()

    def ended(self, label: str) -> None:
        waiting = self._waiting.pop(label, None)
        if waiting is not None:
            waiting.cancel()

    def close(self) -> None:
        for label in list(self._waiting):
            self.ended(label)

    async def _wait(self, label: str, video: IncomingVideo) -> None:
        await asyncio.sleep(self._timeout_s)
        code = first_frame_code(await video.received())
        waiting = self._waiting.get(label)
        if code and waiting is not None:
            waiting.has_failed = True
            waiting.store.failed(ConnectionFailed(reason(code).sentence, code=code))
