"""Keeps the connection to one robot, as programs see it: its state, its stores, its refusals."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping
from typing import Any, Literal

from pydantic import BaseModel

from mosaic_core.machines.peers.bulk_of_operator import BulkState
from mosaic_core.machines.peers.connection_timeline import ConnectionTimeline
from mosaic_core.operator.control.control_channel import ControlChannel
from mosaic_core.operator.control.control_desk import ControlDesk
from mosaic_core.operator.control.needed_leases import NeededLeases
from mosaic_core.operator.control.original_drives import CommandedDrives, ZerosReport
from mosaic_core.operator.delivery.delivery_watcher import DeliveryWatcher
from mosaic_core.operator.delivery.listeners import Listeners, first_heard
from mosaic_core.operator.delivery.session_streams import SessionStreams
from mosaic_core.operator.peers.connection_plan import ConnectionPlan
from mosaic_core.operator.peers.peer_attempt import PeerAttempt
from mosaic_core.operator.peers.store_bindings import StoreBindings
from mosaic_core.operator.stores.channel_plan import Known, answer_patience_s, changed_labels, check_answers
from mosaic_core.operator.stores.mosaic_store import MosaicStore
from mosaic_core.operator.stores.request_caller import RequestCaller, RequestRefused
from mosaic_core.operator.stores.robot_stores import RobotStores
from mosaic_core.operator.stores.store_manager import StoreManager
from mosaic_core.runtime.timing.background_tasks import BackgroundTasks
from mosaic_core.runtime.transport.operator_transport import IncomingVideo, OffererFactory
from mosaic_core.runtime.transport.transport import Channel
from mosaic_core.words import control
from mosaic_core.words.codes import reason
from mosaic_core.words.errors import ConnectionFailed
from mosaic_core.words.signaling import SignalingMessage

State = Literal["connecting", "connected", "reconnecting", "closed"]
FINAL = ("peer.not_allowed", "peer.replaced", "auth.")
"""Ends (or beginnings of their codes) after which trying again would help nobody."""


class RobotConnection(RobotStores):
    """An operator's connection to one robot, made by :meth:`MosaicOperator.connect`. All calls and callbacks on the
    event loop.
    """

    def __init__(
        self,
        plan: ConnectionPlan,
        stores: StoreManager,
        make_offerer: OffererFactory,
        signal: Callable[[SignalingMessage], None],
    ) -> None:
        super().__init__(stores, plan.robot_id)
        self.catalogue = plan.catalogue
        """The full one from the robot itself, once connected. Of an original robot, which announces none: what the
        server's description of it (its ``connectorConfig``) says, or ``None``."""
        self.state: State = "connecting"
        self.error: ConnectionFailed | None = None
        """Why it ended, once :attr:`state` is ``closed``."""
        self.control = ControlDesk(plan.peer_id, plan.clock_us)
        """Who commands: leases, the stop, the other operators."""
        self.near_urls: tuple[str, ...] = ()
        """Where the robot serves operators on its own network itself, whether or not this is one of those networks."""
        self.delivery = DeliveryWatcher(self._say)
        """How the robot's data travels, while anybody asks; what a store itself got and sent is its ``counters``."""
        self._make_offerer = make_offerer
        self._signal = signal
        self._is_kept = False
        self._may_break = False
        self._streams = SessionStreams(self._say, self._missed, plan.clock_us)
        self._interrupted = asyncio.Event()
        self._tasks = BackgroundTasks()
        self._refusals: Listeners[[control.Refusal]] = Listeners()
        self._closings: Listeners[[ConnectionFailed]] = Listeners()
        self._drives = CommandedDrives(stores, plan.robot_id)
        self._callers: dict[str, RequestCaller] = {}
        self._begin(plan)

    def _begin(self, plan: ConnectionPlan, *, was_original: bool = False) -> None:
        """A peer connection, the first one or the next."""
        self._is_breaking = False
        self._plan = plan
        self._peer = PeerAttempt(plan, self, self._make_offerer, self._signal, was_original=was_original)
        self._bindings = StoreBindings(
            self._peer, plan, self._make_offerer, self.control, self._streams, self._make_anew
        )
        self._settled = asyncio.Event()

    # -- what programs use -----------------------------------------------------------------------------------------

    @property
    def session_id(self) -> str | None:
        """The id of the session, which outlives a reconnection; ``None``: the robot keeps none."""
        return self._plan.session_id

    @property
    def peer_id(self) -> str:
        """The id of this operator's connection, as the robot's log writes it."""
        return self._plan.peer_id

    @property
    def is_original(self) -> bool:
        """The robot speaks no ``mosaic.1``: bare payloads, no stop, no leases; people described its connectors."""
        return self._peer.is_ours is False

    @property
    def known(self) -> Known:
        """What is known of its connectors: the robot's own word, or what people described."""
        return Known(self.catalogue, is_told=self.is_original)

    @property
    def bulk_lane(self) -> BulkState:
        """The second peer connection, for connectors with ``delivery: bulk``: ``none`` (none wanted, or the robot
        knows none), ``connecting``, ``up``, or ``failed``: bulk goes over the main one, and it is tried again."""
        return self._bindings.bulk.state

    @property
    def timeline(self) -> ConnectionTimeline:
        """What happened when between the call and the first picture, of the newest attempt."""
        return self._plan.timeline

    @property
    def round_trip_ms(self) -> float | None:
        """The latest ping on the control channel; ``None`` before it and toward original robots."""
        round_trip_us = self._peer.control.clock.round_trip_us
        return None if round_trip_us is None else round_trip_us / 1e3

    @property
    def clock_offset_us(self) -> int | None:
        """What to add to ``time.monotonic_ns() // 1000`` to read the robot's clock."""
        best = self._peer.control.clock.best
        return None if best is None else best.offset_us

    @property
    def round_trip_us_best(self) -> int | None:
        """The shortest round trip of the last ten seconds; half of it bounds the error of the clock offset."""
        best = self._peer.control.clock.best
        return None if best is None else best.round_trip_us

    def on_refusal(self, callback: Callable[[control.Refusal], None]) -> Callable[[], None]:
        """Hear of messages that the robot did not accept, with label, ``seq`` and code; returns what ends it."""
        return self._refusals.add(callback)

    def on_closed(self, callback: Callable[[ConnectionFailed], None]) -> Callable[[], None]:
        """Hear of the end, with its reason; returns what ends it."""
        return self._closings.add(callback)

    async def request(
        self,
        label: str,
        question: BaseModel | Mapping[str, Any] | list[Any],
        *,
        timeout_s: float | None = None,
        on_progress: Callable[[Any], object] | None = None,
    ) -> Any:
        """Ask a connector that answers requests, and wait for its answer (JSON values). ``on_progress``: called with
        what it tells meanwhile. Cancelling the task that waits takes the request back. ``timeout_s``: how long to wait;
        by default a little longer than the connector's class gives itself, so that its own word is heard.

        Raises :class:`RequestRefused` with the code of the robot, and :class:`RequestFailed` where no answer can come:
        out of time, or the way to the robot lost. Raises :class:`ConnectionFailed` where the connector answers none,
        and :class:`MosaicError` (``safety.not_finite``) with its field for a number that JSON does not know.
        """
        check_answers(label, self.known)
        if label not in self._callers:
            self._callers[label] = RequestCaller(self.bidirectional(label))
        try:
            patience_s = answer_patience_s(label, self.known) if timeout_s is None else timeout_s
            return await self._callers[label].request(question, patience_s, on_progress)
        except RequestRefused as refused:
            told = self.control.needed.refused(label, refused.code, self.control.leases)
            raise (RequestRefused(refused.code, told) if told else refused) from None

    def unread_channel(self, label: str) -> Channel:
        """A raw channel, to measure the way to the robot: one of a label that it does not know, it leaves unread."""
        return self._peer.offerer.create_channel(label)

    async def wait_closed(self) -> ConnectionFailed:
        """Until the connection ends for good, with the reason: one that is being made anew has not ended."""
        if self.state == "closed" and self.error is not None:
            return self.error
        return await first_heard(self.on_closed)

    async def send_zeros(self) -> ZerosReport:
        """Ask everything that drives an original robot, as far as described, to stand. Such a robot has no stop: it
        obeys the next command. ``control.stop()`` is for ours."""
        return await self._drives.send_zeros(self.known)

    async def close(self) -> None:
        """Say good-bye and end the connection for good; doing so twice does nothing.

        What drives an original robot, as far as described, and was commanded by this connection is sent a zero before:
        it would go on with the last command. That takes half a second at most, and raises nothing.
        """
        self._is_kept = False
        try:
            if self.state == "connected" and self.is_original:
                await self._drives.leave_standing(self.known, self._bindings.open)
        finally:
            if self.state == "connected":
                self._streams.leaving()
            await self._peer.close()
            await self._bindings.bulk.closed()
        if self.state == "reconnecting":
            self.give_up(ConnectionFailed(reason("peer.closed").sentence, code="peer.closed"))

    # -- called by the operator ------------------------------------------------------------------------------------

    async def open(self, timeout_s: float) -> None:
        """Offer, and wait until connectors can be used; raises :class:`ConnectionFailed`."""
        try:
            async with asyncio.timeout(timeout_s):
                await self._peer.offer()
                await self._settled.wait()
        except TimeoutError:
            self._peer.time_out()
        if self.error is not None:
            raise self.error

    def keep(self) -> None:
        """From now on a loss is no end: the state is ``reconnecting`` until :meth:`reopen` succeeds."""
        self._is_kept = True

    def allow_break(self) -> None:
        """An original robot takes no further camera on a live connection; for one, this may be made anew."""
        self._may_break = True

    async def wait_interrupted(self) -> bool:
        """Until it is lost and worth another try; ``False``: it has ended for good."""
        await self._interrupted.wait()
        self._interrupted.clear()
        return self.state == "reconnecting"

    async def reopen(self, plan: ConnectionPlan, timeout_s: float) -> None:
        """Try once more; stores and leases that were held outside of a block come back. Raises as :meth:`open`."""
        if self.state != "reconnecting":
            return
        await self._peer.close()
        await self._bindings.bulk.closed()
        self.error = None
        self.control.renew(plan.peer_id)
        self._begin(plan, was_original=self.is_original)
        await self.open(timeout_s)
        self.control.regain()

    def doubt(self) -> None:
        """The network of this machine is another one."""
        if self.state == "connected":
            self._peer.doubt()

    def robot_returned(self) -> None:
        """The robot has a new connection to the server: an offer that went over the one before is made anew."""
        if self.state == "reconnecting":
            self._peer.robot_returned()

    def give_up(self, error: ConnectionFailed) -> None:
        """It has ended for good."""
        self.error, self.state = error, "closed"
        self._streams.close()
        for store in self._stores.stores_of(self.robot_id):
            if store.state.phase == "reconnecting":
                store.closed()
        self._interrupted.set()
        for caller in self._callers.values():
            caller.close()
        self._closings.tell(error)

    def signaled(self, message: SignalingMessage) -> None:
        """A signaling message about this connection."""
        self._peer.signaled(message)

    def store_opened(self, store: MosaicStore) -> None:
        """Called by a store that is wanted from now on."""
        self._bindings.open(store)

    def store_released(self, store: MosaicStore) -> None:
        """Called by a store that nobody wants any more."""
        self._drives.released(store)
        self._bindings.release(store)

    # -- told by the peer attempt ----------------------------------------------------------------------------------

    def track_arrived(self, label: str, video: IncomingVideo) -> None:
        """Called by the peer attempt with each track."""
        self._bindings.media.track_arrived(label, video)

    def robot_known(self) -> None:
        """Called by the peer attempt once it knows whether the robot is an original one."""
        if self.is_original:
            self._streams.plain()
            self.control.found_original()
            self.catalogue = self._plan.described
            self._settle()

    def greeted(self, port: ControlChannel, extensions: Mapping[str, int]) -> None:
        """Called by the peer attempt with the robot's hello."""
        self.control.greeted(port, extensions)
        self._streams.greeted(extensions)
        self.delivery.greeted(extensions)
        self._bindings.greeted(extensions)

    def resume_word(self) -> control.Resume:
        """What the hello says of messages that were under way when the connection was lost."""
        return self._streams.resume_word()

    def control_heard(self, message: control.ControlMessage) -> None:
        """Called by the peer attempt with every other message of the control channel."""
        self.control.heard(message)
        match message:
            case control.CatalogueFull(catalogue=catalogue):
                before, self.catalogue = self.catalogue, catalogue
                self.control.needed = NeededLeases(catalogue)
                if self.state == "connected":
                    labels = changed_labels(before, catalogue)
                    self._bindings.catalogue_changed(self.known, self._stores.stores_of(self.robot_id), labels)
                self._settle()
            case control.Resume() | control.Delivered():
                self._streams.progress_heard(message)
            case control.DeliveryReport():
                self.delivery.reported(message)
            case control.Near(urls=urls):
                self.near_urls = urls
            case control.Refusal():
                self._refusals.tell(self._with_its_lease(message))
            case _:
                self._bindings.heard(message)

    def ended(self, error: ConnectionFailed) -> None:
        """Called by the peer attempt when it is over."""
        self.error = error
        comes_back = (self._is_kept or self._is_breaking) and not error.code.startswith(FINAL)
        self._is_breaking = False
        self.control.ended(error, comes_back=comes_back)
        self._bindings.close(comes_back=comes_back)
        self._settled.set()
        if not comes_back:
            self.give_up(error)
            return
        self._streams.lost()
        if self.state == "connected":
            self.state = "reconnecting"
            self._interrupted.set()

    def _settle(self) -> None:
        """The robot's kind and catalogue are known: stores may open."""
        if self.state in ("connecting", "reconnecting") and self._peer.is_ours is not None:
            self.state = "connected"
            for store in self._stores.stores_of(self.robot_id):
                self._bindings.open(store)
            self._bindings.start(self.known)
            self._settled.set()

    def _make_anew(self, label: str) -> bool:
        """An original robot gets a new connection, once for each camera that was asked for too late."""
        if self._peer.is_ours or not self._may_break or label in self._plan.media_labels:
            return False
        if not self._is_breaking:
            self._is_breaking = True
            self._tasks.start(self._break())
        return True

    async def _break(self) -> None:
        """Let go of the connection; nothing that drives may go on meanwhile."""
        await self.send_zeros()
        await self._peer.close()

    def _with_its_lease(self, refusal: control.Refusal) -> control.Refusal:
        """A refusal that tells which lease is missing, where that is the reason."""
        told = self.control.needed.refused(refusal.label, refusal.code, self.control.leases)
        return refusal.model_copy(update={"message": refusal.message or told}) if told else refusal

    def _say(self, message: control.ControlMessage) -> bool:
        return self._peer.say(message)

    def _missed(self, label: str, lost: int | None, is_sent: bool) -> None:
        stores = self._stores.stores_of(self.robot_id)
        store = next((store for store in stores if label in self._bindings.labels(store)), None)
        if store is not None:
            store.missed(lost, sent=is_sent)
