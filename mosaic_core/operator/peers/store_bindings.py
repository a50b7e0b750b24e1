"""Joins the stores of one robot with the channels and tracks of its peer connection."""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass, field
from functools import partial

from mosaic_core.machines.delivery.framing import Frame
from mosaic_core.operator.control.control_desk import ControlDesk
from mosaic_core.operator.delivery.data_port import DataPort, info_of, no_epoch
from mosaic_core.operator.delivery.outgoing_stream import OutgoingStream
from mosaic_core.operator.delivery.session_streams import SessionStreams
from mosaic_core.operator.peers.bulk_of_operator import BulkOfOperator
from mosaic_core.operator.peers.connection_plan import ConnectionPlan
from mosaic_core.operator.peers.media_bindings import MediaBindings, is_media_store
from mosaic_core.operator.peers.peer_attempt import PeerAttempt
from mosaic_core.operator.stores.channel_plan import Known, PlannedChannel, UnknownLabel, check_plan_of, plan_of
from mosaic_core.operator.stores.connection_checking_store import ConnectionCheckingStore
from mosaic_core.operator.stores.mosaic_store import MosaicStore
from mosaic_core.operator.stores.stores import ReceivableStore, SendableStore
from mosaic_core.runtime.delivery.data_port import PeerPartials
from mosaic_core.runtime.transport.operator_transport import Offerer, OffererFactory
from mosaic_core.words.control import CHANNEL_PROTOCOL, ControlMessage, LaneAnswer, LaneCandidate, LaneClose
from mosaic_core.words.data_type import Delivery
from mosaic_core.words.errors import ConnectionFailed


@dataclass(slots=True)
class _Link:
    store: MosaicStore
    ports: dict[str, DataPort] = field(default_factory=dict)
    bulk: Offerer | None = None
    """The second peer connection, if it carries them."""


class StoreBindings:
    """Opens the channels of stores, on the main connection or the one for bulk; tracks it leaves to its ``media``.

    Event loop only. ``streams`` outlive the connection; ``make_anew`` is that of :class:`MediaBindings`.
    """

    def __init__(
        self,
        peer: PeerAttempt,
        plan: ConnectionPlan,
        make_offerer: OffererFactory,
        desk: ControlDesk,
        streams: SessionStreams,
        make_anew: Callable[[str], bool],
    ) -> None:
        self.bulk = BulkOfOperator(plan, make_offerer, peer.say, self)
        self.media = MediaBindings(peer, plan, desk, make_anew)
        self._peer = peer
        self._plan = plan
        self._desk = desk
        self._streams = streams
        self._partials = PeerPartials(self._incomplete)
        self._links: dict[str, _Link] = {}
        self._known: Known | None = None
        self._waiting: dict[str, MosaicStore] = {}

    # -- the life of the connection ----------------------------------------------------------------------------------

    def greeted(self, extensions: Mapping[str, int]) -> None:
        """The robot's hello says whether it takes further offers, and a second connection for bulk."""
        self.media.further_offers.greeted(extensions)
        self.bulk.greeted(extensions)

    def start(self, known: Known) -> None:
        """The connection is up: open what waits, from now on everything at once."""
        self._known = known
        self.media.start(known)
        self._open_waiting()

    def catalogue_changed(self, known: Known, stores: Iterable[MosaicStore], changed: Collection[str]) -> None:
        """The robot has other connectors than before: stores of those begin anew."""
        self._known = known
        self.media.start(known)
        for store in stores:
            if store.robot_connector.connector_id in changed:
                self.release(store)
                self.open(store)

    def heard(self, message: ControlMessage) -> None:
        """A message of the robot about this transport."""
        if isinstance(message, LaneAnswer | LaneCandidate | LaneClose):
            self.bulk.heard(message)
        else:
            self.media.heard(message)

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

    def close(self, *, comes_back: bool = False) -> None:
        """The connection is gone; the stores wait for the next one."""
        self.bulk.close()
        for link in tuple(self._links.values()):
            link.store.disconnected(comes_back=comes_back)
        self._partials.closed([label for link in self._links.values() for label in link.ports])
        self._links.clear()
        self.media.close(comes_back=comes_back)

    # -- stores ------------------------------------------------------------------------------------------------------

    def open(self, store: MosaicStore) -> None:
        """Open the channels of ``store``, or show its track."""
        label = store.robot_connector.connector_id
        if self._known is None:
            self._waiting[label] = store
            return
        try:
            plan = _channels_of(store, self._known)
        except ConnectionFailed as error:
            store.failed(error, error.nearest if isinstance(error, UnknownLabel) else None)
            return
        if is_media_store(store):
            store.opening()
            self.media.open(store)
            return
        is_bulk = self._is_ours and any(channel.delivery is Delivery.BULK for channel in plan)
        if is_bulk and not self.bulk.settled():
            self._waiting[label] = store
            return
        store.opening()
        link = self._links[label] = _Link(store, bulk=self.bulk.offerer if is_bulk else None)
        for channel in plan:
            link.ports[channel.label] = self._opened_port(link, channel)

    def release(self, store: MosaicStore) -> None:
        """Close what :meth:`open` opened."""
        label = store.robot_connector.connector_id
        self._waiting.pop(label, None)
        if is_media_store(store):
            self.media.release(store)
            return
        link = self._links.pop(label, None)
        if link is None or link.store is not store:
            return
        for label, port in link.ports.items():
            port.close()
            self._streams.released(label)
        store.closed()

    def labels(self, store: MosaicStore) -> tuple[str, ...]:
        """The channels of a store; before they are open, its own label."""
        label = store.robot_connector.connector_id
        link = self._links.get(label)
        return tuple(link.ports) if link is not None and link.ports else (label,)

    # -- inside ------------------------------------------------------------------------------------------------------

    @property
    def _is_ours(self) -> bool:
        return self._known is not None and not self._known.is_told

    def _open_waiting(self) -> None:
        waiting, self._waiting = self._waiting, {}
        for store in waiting.values():
            self.open(store)

    def _incomplete(self, label: str, seq: int) -> None:
        """The rest of a large message is not waited for any more."""
        for link in self._links.values():
            link.store.counters.incomplete += label in link.ports

    def _opened_port(self, link: _Link, planned: PlannedChannel) -> DataPort:
        is_latest = planned.delivery is Delivery.LATEST and self._is_ours
        channel = (link.bulk or self._peer.offerer).create_channel(
            planned.label,
            protocol=CHANNEL_PROTOCOL if self._is_ours else "",
            ordered=not is_latest,
            max_retransmits=0 if is_latest else None,
        )
        received: Callable[[Frame], None] = partial(self._deliver, link.store, planned)
        if self._is_ours and planned.delivery is Delivery.RELIABLE:
            received = partial(self._streams.arrived, planned.label, deliver=received)
        return DataPort(
            channel,
            planned.delivery,
            received,
            partial(self._port_changed, link, planned),
            clock_us=self._plan.clock_us,
            epoch=no_epoch if planned.resource is None else partial(self._desk.epoch_of, planned.resource),
            counters=link.store.counters,
            partials=self._partials,
        )

    def _deliver(self, store: MosaicStore, planned: PlannedChannel, frame: Frame) -> None:
        self._plan.timeline.mark("value", time.monotonic(), planned.label)
        if isinstance(store, ReceivableStore):
            to_ours_us = self._peer.control.clock.to_ours_us
            info = info_of(frame, to_ours_us, self._plan.clock_us(), planned.schema_id)
            store.notify_subscribers(frame.payload, info)

    def _port_changed(self, link: _Link, planned: PlannedChannel, is_open: bool) -> None:
        store, port = link.store, link.ports[planned.label]
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
            send = port.send if stream is None else stream.send
            store.connect_outlet(send, outlives=stream is not None, has_arrived=lambda: port.has_arrived)
        if all(port.is_open for port in link.ports.values()):
            store.opened()

    def _stream(self, store: MosaicStore, planned: PlannedChannel) -> OutgoingStream | None:
        """What outlives the channel; ``None``: nothing does."""
        if not (self._is_ours and planned.sends and planned.may_wait):
            return None
        return self._streams.outgoing(planned.label, waits=not isinstance(store, ConnectionCheckingStore))


def _channels_of(store: MosaicStore, known: Known) -> tuple[PlannedChannel, ...]:
    """Raises :class:`ConnectionFailed`."""
    if isinstance(store, ConnectionCheckingStore):
        return check_plan_of(store.robot_connector, known).channels
    return plan_of(store.robot_connector, known).channels
