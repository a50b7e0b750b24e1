"""Joins the stores of one robot with the channels and tracks of its peer connection."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial

from mosaic_core.machines.delivery.framing import Frame
from mosaic_core.operator.delivery.data_port import DataPort, info_of, no_epoch
from mosaic_core.operator.delivery.outgoing_stream import OutgoingStream
from mosaic_core.operator.delivery.session_streams import SessionStreams
from mosaic_core.operator.peers.bulk_of_operator import BulkOfOperator
from mosaic_core.operator.peers.connection_plan import ConnectionPlan
from mosaic_core.operator.peers.first_frame_watch import FirstFrameWatch
from mosaic_core.operator.peers.further_offers import FurtherOffers
from mosaic_core.operator.peers.peer_attempt import PeerAttempt
from mosaic_core.operator.stores.channel_plan import (
    Known,
    PlannedChannel,
    UnknownLabel,
    check_plan_of,
    plan_of,
    sound_store,
)
from mosaic_core.operator.stores.connection_checking_store import ConnectionCheckingStore
from mosaic_core.operator.stores.media_store import MediaStreamStore
from mosaic_core.operator.stores.mosaic_store import MosaicStore
from mosaic_core.operator.stores.sound_stores import SoundStore, VoiceStore
from mosaic_core.operator.stores.stores import ReceivableStore, SendableStore
from mosaic_core.runtime.delivery.peer_partials import PeerPartials
from mosaic_core.runtime.transport.operator_transport import IncomingVideo, Offerer, OffererFactory
from mosaic_core.words.control import CHANNEL_PROTOCOL
from mosaic_core.words.data_type import Delivery
from mosaic_core.words.errors import ConnectionFailed

NO_LINE = "The connection was made without a media line for this connector; connect again to use it."
LATE_FOR_ORIGINAL = "An original robot takes no further camera on a live connection."
LATE_CURE = "Name it in connect(connectors=[…]), or allow a short break: connect(may_break=True)."
IS_SOUND = "This connector is sound: make its store once the robot's catalogue is known."


@dataclass(frozen=True, slots=True)
class Surroundings:
    """What the stores need of their connection: ``watch(label, on)`` asks the robot for pictures, ``to_ours_us`` maps
    its clock to ours, which ``clock_us`` reads; ``epoch_of(resource)`` is what a command carries; ``shown(label,
    rtp_timestamp)`` hears of every picture that a store has got. ``streams`` outlive the connection."""

    watch: Callable[[str, bool], None]
    to_ours_us: Callable[[int], int | None]
    clock_us: Callable[[], int]
    epoch_of: Callable[[str], int]
    shown: Callable[[str, int | None], None]
    streams: SessionStreams
    arrived: Callable[[str], None] = lambda _label: None
    make_anew: Callable[[str], bool] = lambda _label: False
    """Whether the connection is made anew, with a line for this picture, for a robot that takes no further offer."""


@dataclass(slots=True)
class _Link:
    store: MosaicStore
    ports: dict[str, DataPort] = field(default_factory=dict)
    bulk: Offerer | None = None
    """The second peer connection, if it carries them."""


class StoreBindings:
    """Event loop only."""

    def __init__(
        self,
        peer: PeerAttempt,
        plan: ConnectionPlan,
        make_offerer: OffererFactory,
        around: Surroundings,
    ) -> None:
        self.bulk = BulkOfOperator(plan, make_offerer, peer.say, self)
        self.further_offers = FurtherOffers(peer.offerer, peer.say, self.lines_settled)
        self._offerer = peer.offerer
        self._lineless: set[str] = set()
        self._voices = peer.voices
        self._around = around
        self._links: dict[str, _Link] = {}
        self._partials = PeerPartials(self._incomplete)
        self._videos: dict[str, tuple[IncomingVideo, asyncio.Task[None]]] = {}
        self._talkers: dict[str, str | None] = {}
        self._first_frames = FirstFrameWatch()
        self._known = Known(None)
        self._offered: frozenset[str] = frozenset()
        self._is_ours: bool | None = None
        self._waiting: dict[str, MosaicStore] = {}

    def start(self, known: Known, offered: Sequence[str]) -> None:
        """The connection is up, with media lines for what was ``offered``: open what waits, from now on everything at
        once."""
        self._known, self._offered, self._is_ours = known, frozenset(offered), not known.is_told
        self._open_waiting()

    def greeted(self, extensions: Mapping[str, int]) -> None:
        """The robot's hello says whether it takes further offers, and a second connection for bulk."""
        self.further_offers.greeted(is_known="renegotiate" in extensions)
        self.bulk.greeted(extensions)

    def bulk_changed(self, lost: Offerer | None) -> None:
        """There is a second peer connection for bulk, or there is none any more: what was on it opens anew."""
        for label, link in list(self._links.items()):
            if lost is not None and link.bulk is lost:
                del self._links[label]
                for port in link.ports.values():
                    port.close()
                link.store.closed()
                self._waiting[label] = link.store
        self._open_waiting()

    def _open_waiting(self) -> None:
        waiting, self._waiting = self._waiting, {}
        for store in waiting.values():
            self.open(store)

    def open(self, store: MosaicStore) -> None:
        """Open the channels of ``store``, or show its track."""
        label = store.robot_connector.connector_id
        if self._is_ours is None:
            self._waiting[label] = store
            return
        try:
            plan = self._plan_of(store)
        except UnknownLabel as error:
            store.failed(error, error.nearest)
            return
        except ConnectionFailed as error:
            store.failed(error)
            return
        is_bulk = self._is_ours and any(channel.delivery is Delivery.BULK for channel in plan)
        if is_bulk and not self.bulk.settled():
            self._waiting[label] = store
            return
        store.opening()
        link = self._links[label] = _Link(store, bulk=self.bulk.offerer if is_bulk else None)
        if isinstance(store, VoiceStore):
            self._lend_voice(store)
            return
        if isinstance(store, MediaStreamStore | SoundStore):
            self._show(store)
            return
        for channel in plan:
            link.ports[channel.label] = self._port(store, link, channel)

    def release(self, store: MosaicStore) -> None:
        """Close what :meth:`open` opened."""
        label = store.robot_connector.connector_id
        self._waiting.pop(label, None)
        link = self._links.pop(label, None)
        if link is None or link.store is not store:
            return
        if isinstance(store, MediaStreamStore | SoundStore):
            self._around.watch(label, False)
            self._first_frames.ended(label)
        for label, port in link.ports.items():
            port.close()
            self._around.streams.released(label)
        store.closed()

    def track_arrived(self, label: str, video: IncomingVideo) -> None:
        """Take its frames from now on, whether anybody looks or not: left alone they would fill the memory."""
        self._videos[label] = (video, asyncio.create_task(self._take(label, video)))
        self.lines_settled(label)

    def lines_settled(self, *labels: str) -> None:
        """The lines of these pictures, or of all that wait for one, are there, or will never be."""
        for label in self._lineless & set(labels or self._lineless):
            self._lineless.discard(label)
            link = self._links.get(label)
            if link is not None and isinstance(link.store, MediaStreamStore):
                self._show(link.store)

    def unavailable(self, label: str, error: ConnectionFailed) -> None:
        """The robot says that there is no picture under this label."""
        link = self._links.get(label)
        if link is not None:
            link.store.failed(error)

    def talking_changed(self, label: str, name: str | None) -> None:
        """Who is heard on the loudspeaker ``label`` now."""
        self._talkers[label] = name
        link = self._links.get(label)
        if link is not None and isinstance(link.store, VoiceStore):
            link.store.talking_changed(name)

    def labels(self, store: MosaicStore) -> tuple[str, ...]:
        """The channels of a store; before they are open, its own label."""
        label = store.robot_connector.connector_id
        link = self._links.get(label)
        return tuple(link.ports) if link is not None and link.ports else (label,)

    def _incomplete(self, label: str, seq: int) -> None:
        """The rest of a large message is not waited for any more."""
        for link in self._links.values():
            link.store.counters.incomplete += label in link.ports

    def close(self, *, comes_back: bool = False) -> None:
        """The connection is gone; the stores wait for the next one."""
        self.bulk.close()
        self.further_offers.close()
        for link in list(self._links.values()):
            if comes_back:
                link.store.interrupted()
            else:
                link.store.closed()
        self._partials.closed([label for link in self._links.values() for label in link.ports])
        self._links.clear()
        self._first_frames.close()
        for video, task in self._videos.values():
            task.cancel()
            video.stop()
        self._videos.clear()

    def _plan_of(self, store: MosaicStore) -> tuple[PlannedChannel, ...]:
        if isinstance(store, ConnectionCheckingStore):
            return check_plan_of(store.robot_connector, self._known).channels
        return plan_of(store.robot_connector, self._known).channels

    def _lend_voice(self, store: VoiceStore) -> None:
        label = store.robot_connector.connector_id
        if label not in self._voices:
            store.failed(ConnectionFailed(NO_LINE, code="media.no_line"))
            return
        store.connect_line(self._voices[label])
        store.talking_changed(self._talkers.get(label))
        store.opened()

    def _began(self, label: str, store: MosaicStore) -> None:
        if isinstance(store, MediaStreamStore):
            self._first_frames.began(label, store, self._videos[label][0])

    def _show(self, store: MediaStreamStore | SoundStore) -> None:
        label = store.robot_connector.connector_id
        catalogue = self._known.catalogue
        is_sound = catalogue is not None and sound_store(store.robot_connector, catalogue) is not None
        if is_sound != isinstance(store, SoundStore):
            store.failed(ConnectionFailed(IS_SOUND, code="channel.unknown_label", cure=""))
            return
        if label not in self._videos:
            if not is_sound and self.further_offers.want(label):
                self._lineless.add(label)
            elif is_sound or not self._around.make_anew(label):
                store.failed(self._no_line(label))
            return
        self._around.watch(label, True)
        store.opened()
        self._began(label, store)

    def _no_line(self, label: str) -> ConnectionFailed:
        if self._is_ours:
            return ConnectionFailed(NO_LINE, code="media.no_line")
        if label not in self._offered:
            return ConnectionFailed(LATE_FOR_ORIGINAL, code="media.no_line", cure=LATE_CURE)
        sends = ", ".join(map(repr, self._videos)) or "no picture at all"
        message = f"The robot gave none of its cameras the line of {label!r}; it sends {sends}."
        cure = "An original robot gives them out in the order of its file: name all that come before."
        return ConnectionFailed(message, code="media.no_line", cure=cure)

    async def _take(self, label: str, video: IncomingVideo) -> None:
        while (frame := await video.next()) is not None:
            link = self._links.get(label)
            if link is not None and isinstance(link.store, MediaStreamStore):
                link.store.frame_arrived(frame)
                self._first_frames.arrived(label)
                self._around.shown(label, video.rtp_timestamp(frame))
            elif link is not None and isinstance(link.store, SoundStore):
                link.store.sound_arrived(frame)

    def _port(self, store: MosaicStore, link: _Link, planned: PlannedChannel) -> DataPort:
        is_latest = planned.delivery is Delivery.LATEST and self._is_ours is True
        channel = (link.bulk or self._offerer).create_channel(
            planned.label,
            protocol=CHANNEL_PROTOCOL if self._is_ours else "",
            ordered=not is_latest,
            max_retransmits=0 if is_latest else None,
        )

        def handed(frame: Frame) -> None:
            self._around.arrived(planned.label)
            if isinstance(store, ReceivableStore):
                store.notify_subscribers(
                    frame.payload, info_of(frame, self._around.to_ours_us, self._around.clock_us())
                )

        def numbered(frame: Frame) -> None:
            self._around.streams.arrived(planned.label, frame, handed)

        received = numbered if self._is_ours and planned.delivery is Delivery.RELIABLE else handed

        def changed(is_open: bool) -> None:
            self._port_changed(link, planned, is_open)

        resource = planned.resource
        epoch = no_epoch if resource is None else partial(self._around.epoch_of, resource)
        return DataPort(
            channel,
            planned.delivery,
            received,
            changed,
            clock_us=self._around.clock_us,
            epoch=epoch,
            counters=store.counters,
            partials=self._partials,
        )

    def _stream(self, store: MosaicStore, planned: PlannedChannel) -> OutgoingStream | None:
        """What outlives the channel; ``None``: nothing does."""
        if not (self._is_ours and planned.sends and planned.may_wait):
            return None
        return self._around.streams.outgoing(planned.label, waits=not isinstance(store, ConnectionCheckingStore))

    def _port_changed(self, link: _Link, planned: PlannedChannel, is_open: bool) -> None:
        store = link.store
        port = link.ports[planned.label]
        stream = self._stream(store, planned)
        if not is_open:
            if stream is not None:
                stream.detach()
            if store.state.phase == "open":
                store.closed()
            return
        if stream is not None:
            port.on_drained = stream.pump
            stream.attach(port)
        if planned.sends and isinstance(store, SendableStore):
            if stream is None:
                store.connect_outlet(port.send, has_arrived=lambda: port.has_arrived)
            else:
                store.connect_outlet(stream.send, outlives=True, has_arrived=lambda: port.has_arrived)
        if all(port.is_open for port in link.ports.values()):
            store.opened()
