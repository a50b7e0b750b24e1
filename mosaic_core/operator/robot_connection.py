"""One peer connection to one robot: carries out what ``machines.operator_peer`` decides, and holds its stores."""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal, TypeVar

from mosaic_core.machines import operator_peer as machine
from mosaic_core.operator.control_port import ControlPort
from mosaic_core.operator.media_store import MediaStreamStore
from mosaic_core.operator.robot_connector import RobotConnector
from mosaic_core.operator.store_links import StoreLinks
from mosaic_core.operator.store_manager import StoreManager
from mosaic_core.operator.stores import BidirectionalStore, MosaicStore, ReceivableStore, SendableStore
from mosaic_core.runtime.operator_transport import IncomingVideo, OffererFactory
from mosaic_core.words import control, signaling
from mosaic_core.words.catalogue import Catalogue
from mosaic_core.words.codes import REASONS, reason
from mosaic_core.words.data_type import MosaicDataType
from mosaic_core.words.errors import ConnectionFailed, MosaicError
from mosaic_core.words.ice import IceServer
from mosaic_core.words.signaling import IceCandidate, SignalingMessage

_log = logging.getLogger(__name__)
S = TypeVar("S", bound=MosaicStore)
State = Literal["connecting", "connected", "closed"]


@dataclass(frozen=True, slots=True)
class ConnectionPlan:
    """What a connection is made from."""

    robot_id: str
    peer_id: str
    session_id: str | None
    catalogue: Catalogue | None
    media_labels: tuple[str, ...]
    ice_servers: tuple[IceServer, ...]
    agreed: dict[str, int]


class RobotConnection:
    """Made by :meth:`MosaicOperator.connect`. All calls and callbacks on the event loop."""

    def __init__(
        self,
        plan: ConnectionPlan,
        stores: StoreManager,
        make_offerer: OffererFactory,
        send: Callable[[SignalingMessage], None],
    ) -> None:
        self.robot_id = plan.robot_id
        self.catalogue = plan.catalogue
        self.state: State = "connecting"
        self.error: ConnectionFailed | None = None
        """Why it ended, once :attr:`state` is ``closed``."""
        self._plan = plan
        self._stores = stores
        self._send = send
        self._machine = machine.OperatorPeer(time.monotonic())
        self._offerer = make_offerer(self, plan.ice_servers)
        self._control: ControlPort | None = None
        self._links = StoreLinks(self._offerer, self._watch, self._to_ours_us)
        self._refusals: list[Callable[[control.Refusal], None]] = []
        self._closings: list[Callable[[ConnectionFailed], None]] = []
        self._woken = asyncio.Event()
        self._settled = asyncio.Event()
        self._is_ours: bool | None = None
        self._tasks: set[asyncio.Task[None]] = set()
        self._clock: asyncio.Task[None] | None = None

    # -- what programs use -----------------------------------------------------------------------------------------

    @property
    def session_id(self) -> str | None:
        return self._plan.session_id

    @property
    def peer_id(self) -> str:
        return self._plan.peer_id

    @property
    def is_original(self) -> bool:
        """The robot speaks no ``mosaic.1``: no catalogue, bare payloads."""
        return self._is_ours is False

    @property
    def round_trip_ms(self) -> float | None:
        """The latest ping on the control channel; ``None`` before it and toward original robots."""
        return self._control.round_trip_ms if self._control else None

    @property
    def clock_offset_us(self) -> int | None:
        """What to add to ``time.monotonic_ns() // 1000`` to read the robot's clock."""
        return self._control.clock_offset_us if self._control else None

    @property
    def round_trip_us_best(self) -> int | None:
        """The shortest round trip of the last ten seconds; half of it bounds the error of the clock offset."""
        return self._control.best_round_trip_us if self._control else None

    def on_refusal(self, callback: Callable[[control.Refusal], None]) -> Callable[[], None]:
        """Hear of messages that the robot did not accept, with label, ``seq`` and code; returns what ends it."""
        self._refusals.append(callback)
        return lambda: self._refusals.remove(callback) if callback in self._refusals else None

    def on_closed(self, callback: Callable[[ConnectionFailed], None]) -> Callable[[], None]:
        """Hear of the end, with its reason; returns what ends it."""
        self._closings.append(callback)
        return lambda: self._closings.remove(callback) if callback in self._closings else None

    def receivable(self, label: str, data_type: MosaicDataType | None = None) -> ReceivableStore:
        """The store of a robot → operator connector; ``data_type`` only for original robots."""
        return self._store(label, data_type, ReceivableStore)

    def sendable(self, label: str, data_type: MosaicDataType | None = None) -> SendableStore:
        """The store of an operator → robot connector."""
        return self._store(label, data_type, SendableStore)

    def bidirectional(self, label: str) -> BidirectionalStore:
        return self._store(label, MosaicDataType.JSON_BI, BidirectionalStore)

    def media(self, label: str) -> MediaStreamStore:
        """The store of a camera."""
        return self._store(label, MosaicDataType.MEDIA, MediaStreamStore)

    async def wait_closed(self) -> ConnectionFailed:
        """Until the connection ends, with the reason."""
        ended: asyncio.Future[ConnectionFailed] = asyncio.get_running_loop().create_future()
        if self.error is not None:
            return self.error
        end = self.on_closed(lambda error: None if ended.done() else ended.set_result(error))
        try:
            return await ended
        finally:
            end()

    async def close(self) -> None:
        """Say good-bye and end the connection; doing so twice does nothing."""
        self._handle(machine.CloseRequested())
        if self._clock is not None:
            self._clock.cancel()
        await self._offerer.close()

    def _store(self, label: str, data_type: MosaicDataType | None, kind: type[S]) -> S:
        connector = RobotConnector(self.robot_id, label, data_type)
        store = self._stores.get_or_create_store(connector)
        if isinstance(store, kind):
            return store
        self._stores.release_store(connector)
        message = f"{label!r} has a {type(store).__name__}, not a {kind.__name__}."
        raise ConnectionFailed(message, code="channel.unknown_label", cure="")

    # -- making it ---------------------------------------------------------------------------------------------------

    async def open(self, timeout_s: float) -> None:
        """Offer, and wait until connectors can be used; raises :class:`ConnectionFailed`."""
        self._clock = asyncio.create_task(self._keep_time())
        try:
            async with asyncio.timeout(timeout_s):
                await self._offer()
                await self._settled.wait()
        except TimeoutError:
            code = machine.TIMEOUTS.get(self._machine.phase, (0.0, "channel.timeout"))[1]
            self._handle(machine.EndReceived(code))
        if self.error is not None:
            raise self.error

    async def _offer(self) -> None:
        for label in self._plan.media_labels:
            self._offerer.add_video(label)
        channel = self._offerer.create_channel(control.CONTROL_LABEL, protocol=control.CHANNEL_PROTOCOL)
        self._control = ControlPort(channel, self._heard)
        try:
            sdp, tracks = await self._offerer.offer()
            knows_tracks = "catalogue" in self._plan.agreed
            named = dict(tracks) if knows_tracks and self.catalogue is not None else None
            self._send(signaling.SdpOffer(rtc_connection_id=self.peer_id, sdp_offer=sdp, tracks=named))
        except MosaicError as error:
            self._handle(machine.EndReceived(error.code, error.message))
            return
        self._handle(machine.Offered())

    def hear(self, message: SignalingMessage) -> None:
        """A signaling message about this connection."""
        match message:
            case signaling.SdpAnswer(sdp_answer=sdp):
                self._run(self._accept(sdp))
            case signaling.ExchangeIceCandidate(ice_candidate=candidate):
                self._run(self._offerer.add_candidate(candidate))
            case signaling.ClosePeerConnection(code=code, message=text):
                self._handle(machine.EndReceived(code or "peer.closed", text or ""))
            case _:
                pass

    async def _accept(self, sdp: str) -> None:
        if self._machine.phase != "waiting":
            return
        try:
            await self._offerer.accept_answer(sdp)
        except ConnectionFailed as error:
            self._handle(machine.EndReceived(error.code, error.message))
        else:
            self._handle(machine.Answered())

    # -- told by the peer connection ---------------------------------------------------------------------------------

    def candidate_found(self, candidate: IceCandidate) -> None:
        try:
            self._send(signaling.ExchangeIceCandidate(rtc_connection_id=self.peer_id, ice_candidate=candidate))
        except MosaicError as error:
            _log.debug("a candidate could not be sent: %s", error.message)

    def state_changed(self, state: str) -> None:
        self._handle(machine.TransportChanged(state))

    def track_arrived(self, label: str, video: IncomingVideo) -> None:
        self._links.track_arrived(label, video)

    # -- told by the store manager -------------------------------------------------------------------------------------

    def store_opened(self, store: MosaicStore) -> None:
        self._links.open(store)

    def store_released(self, store: MosaicStore) -> None:
        self._links.release(store)

    # -- the control channel -----------------------------------------------------------------------------------------

    def _heard(self, message: control.ControlMessage) -> None:
        match message:
            case control.Hello():
                self._handle(machine.HelloReceived())
                return
            case control.CatalogueFull(catalogue=catalogue):
                self.catalogue = catalogue
                self._settle()
            case control.Refusal():
                for callback in list(self._refusals):
                    callback(message)
            case control.MediaUnavailable(label=label, code=code, message=text):
                known = code if code in REASONS else "media.no_line"
                self._links.unavailable(label, ConnectionFailed(text or reason(known).sentence, code=known))
            case control.Bye(code=code, message=text):
                self._handle(machine.EndReceived(code, text or ""))
                return
            case _:
                pass
        self._handle(machine.ControlReceived())

    def _watch(self, label: str, on: bool) -> None:
        if self._control is not None and self._is_ours:
            self._control.send(control.MediaWatch(label=label, on=on))

    def _to_ours_us(self, theirs_us: int) -> int | None:
        return self._control.to_ours_us(theirs_us) if self._control else None

    # -- the machine -------------------------------------------------------------------------------------------------

    def _handle(self, event: machine.Event) -> None:
        for effect in self._machine.handle(event, time.monotonic()):
            match effect:
                case machine.SendPing():
                    if self._control is not None:
                        self._control.ping()
                case machine.UseConnection(is_ours):
                    self._is_ours = is_ours
                    if not is_ours:
                        self._settle()
                case machine.End():
                    self._end(effect)
        self._woken.set()

    def _settle(self) -> None:
        """The robot's kind and catalogue are known: stores may open."""
        if self.state == "connecting" and self._is_ours is not None:
            self.state = "connected"
            for store in self._stores.stores_of(self.robot_id):
                self._links.open(store)
            self._links.start(self.catalogue if self._is_ours else None, is_ours=self._is_ours)
            self._settled.set()

    def _end(self, end: machine.End) -> None:
        known = end.code if end.code in REASONS else "peer.closed"
        self.error = ConnectionFailed(end.message or reason(known).sentence, code=known)
        self.state = "closed"
        if end.tells_robot:
            self._say_bye()
        self._links.close()
        self._run(self._offerer.close())
        self._settled.set()
        for callback in list(self._closings):
            callback(self.error)

    def _say_bye(self) -> None:
        if self._control is not None and self._is_ours:
            self._control.send(control.Bye())
        try:
            self._send(signaling.ClosePeerConnection(rtc_connection_id=self.peer_id))
        except MosaicError as error:
            _log.debug("the server could not be told: %s", error.message)

    async def _keep_time(self) -> None:
        while self._machine.phase != "closed":
            self._woken.clear()
            deadline_s = self._machine.deadline_s
            try:
                async with asyncio.timeout(None if deadline_s is None else deadline_s - time.monotonic()):
                    await self._woken.wait()
            except TimeoutError:
                self._handle(machine.DeadlinePassed())

    def _run(self, work: object) -> None:
        task: asyncio.Task[None] = asyncio.ensure_future(work)  # type: ignore[call-overload]
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)


def media_labels_of(catalogue: Catalogue | None, stores: Sequence[MosaicStore]) -> tuple[str, ...]:
    """One media line per camera of the catalogue, in its order; without one, for the stores that exist."""
    if catalogue is not None:
        return tuple(entry.label for entry in catalogue.entries if entry.data_type is MosaicDataType.MEDIA)
    return tuple(store.robot_connector.connector_id for store in stores if isinstance(store, MediaStreamStore))
