"""Declares what all stores have in common: a program holds one of a connector, whatever happens to the connection
underneath.

All methods and callbacks on the event loop. The names and their meaning are those of the dashboard's stores.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal, TypeVar, get_args

from mosaic_core.operator.delivery.listeners import Listeners
from mosaic_core.operator.delivery.store_counters import StoreCounters
from mosaic_core.operator.stores.robot_connector import RobotConnector
from mosaic_core.words.codes import reason
from mosaic_core.words.errors import ConnectionFailed, MosaicError

T = TypeVar("T")
_log = logging.getLogger(__name__)

StoreMoment = Literal["before_connected", "after_connected", "after_disconnected", "after_connection_failed"]
MOMENTS: tuple[StoreMoment, ...] = get_args(StoreMoment)
HOPELESS = ("channel.unknown_label", "media.no_line")
"""Codes of failures that waiting does not mend."""


@dataclass(frozen=True, slots=True)
class StoreState:
    """The state of a store: ``waiting`` for a connection, ``open``, ``reconnecting`` (it was lost and is being made
    anew), ``closed``, or ``mismatch``: the robot has nothing under this label.
    """

    phase: Literal["waiting", "open", "reconnecting", "closed", "mismatch"] = "waiting"
    code: str = ""
    message: str = ""
    nearest: str | None = None
    cure: str | None = None


@dataclass(frozen=True, slots=True)
class Gap:
    """Messages that are missing between two others. ``lost`` messages of a reliable connector will never arrive: the
    connection was gone for longer than they could be kept. ``None``: nobody knows how many. ``sent``: those that this
    store sent, not those that it gets.
    """

    lost: int | None
    sent: bool = False


class MosaicStore:
    """The base of all stores. A class of one's own overrides :meth:`before_connected`, :meth:`after_connected`,
    :meth:`after_disconnected` and :meth:`after_connection_failed`; anybody else subscribes with ``on_…(callback)``.

    Overridden ``on_…`` methods without an argument are called too, as they were before those names existed.
    """

    def __init__(self, robot_connector: RobotConnector) -> None:
        self.robot_connector = robot_connector
        self.state = StoreState()
        self.counters = StoreCounters()
        """What it has received and sent since it was made."""
        self._listeners = {moment: self._own_listeners(moment) for moment in MOMENTS}
        self._changed = asyncio.Event()
        self._gap_listeners: Listeners[[Gap]] = Listeners()
        self.warns_of_gaps = True
        """Whether the log tells of messages that were lost; not where whoever sent them hears of it anyway."""

    def before_connected(self) -> None:
        """The channel or track is about to be opened."""

    def after_connected(self) -> None:
        """Data can flow."""

    def after_disconnected(self) -> None:
        """The channel or track is gone; the store waits for the next one."""

    def after_connection_failed(self) -> None:
        """It could not be opened; :attr:`state` says why."""

    def on_before_connected(self, callback: Callable[[], None]) -> Callable[[], None]:
        """Call ``callback()`` before the channel or track is opened, each time; returns what ends it."""
        return self.when("before_connected", callback)

    def on_after_connected(self, callback: Callable[[], None]) -> Callable[[], None]:
        """Call ``callback()`` as soon as data can flow, each time; returns what ends it."""
        return self.when("after_connected", callback)

    def on_after_disconnected(self, callback: Callable[[], None]) -> Callable[[], None]:
        """Call ``callback()`` when the channel or track is gone, each time; returns what ends it."""
        return self.when("after_disconnected", callback)

    def on_after_connection_failed(self, callback: Callable[[], None]) -> Callable[[], None]:
        """Call ``callback()`` when it could not be opened; :attr:`state` says why. Returns what ends it."""
        return self.when("after_connection_failed", callback)

    def when(self, moment: StoreMoment, callback: Callable[[], None]) -> Callable[[], None]:
        """Call ``callback`` at each such moment; returns what ends it."""
        return self._listeners[moment].add(callback)

    def on_gap(self, callback: Callable[[Gap], None]) -> Callable[[], None]:
        """Call ``callback(gap)`` when messages were lost across a reconnection; returns what ends it."""
        return self._gap_listeners.add(callback)

    async def wait_open(self, timeout_s: float = 10.0) -> None:
        """Until data can flow; raises :class:`ConnectionFailed` with the reason, or ``channel.timeout``."""
        try:
            async with asyncio.timeout(timeout_s):
                while self.state.phase != "open":
                    self._raise_if_hopeless()
                    self._changed.clear()
                    await self._changed.wait()
        except TimeoutError:
            label = self.robot_connector.connector_id
            raise ConnectionFailed(f"{label!r} did not open in time.", code="channel.timeout") from None

    def _raise_if_hopeless(self) -> None:
        """Nothing will come of it on this connection."""
        if self.state.code in HOPELESS:
            raise ConnectionFailed(self.state.message, code=self.state.code, cure=self.state.cure)

    async def _first_of(
        self, listen: Callable[[Callable[[T], None]], Callable[[], None]], what: str, timeout_s: float
    ) -> T:
        """The first value that ``listen(callback)`` gives from now on; raises as :meth:`ReceivableStore.next_message`
        where none comes."""
        arrival: asyncio.Future[T] = asyncio.get_running_loop().create_future()
        end = listen(lambda value: None if arrival.done() else arrival.set_result(value))
        try:
            async with asyncio.timeout(timeout_s):
                before = self.state  # one that is closed may be opened by the connection that is being made
                while not arrival.done():
                    self._raise_if_over(before)
                    await self._arrived_or_changed(arrival)
                return arrival.result()
        except TimeoutError:
            label, why = self.robot_connector.connector_id, self._why_not_open()
            raise TimeoutError(f"no {what} of {label!r} within {timeout_s:g} s{why}") from None
        finally:
            end()

    def _why_not_open(self) -> str:
        told = f": {self.state.message}" if self.state.message else ""
        return "" if self.state.phase == "open" else f"; it is {self.state.phase}{told}"

    async def _arrived_or_changed(self, arrival: asyncio.Future[Any]) -> None:
        self._changed.clear()
        change = asyncio.ensure_future(self._changed.wait())
        try:
            await asyncio.wait((arrival, change), return_when=asyncio.FIRST_COMPLETED)
        finally:
            change.cancel()

    def _raise_if_over(self, before: StoreState) -> None:
        """Nothing comes any more: it has been closed since ``before``."""
        self._raise_if_hopeless()
        if self.state.phase == "closed" and self.state is not before:
            text = self.state.message or reason("peer.closed").sentence
            raise ConnectionFailed(text, code=self.state.code or "peer.closed", cure=self.state.cure)

    # -- called by the connection ----------------------------------------------------------------------------------

    def opening(self) -> None:
        """The channel or track is about to be opened."""
        self._moment("before_connected")

    def opened(self) -> None:
        """Data can flow."""
        self._enter(StoreState("open"))
        self._moment("after_connected")

    def closed(self) -> None:
        """The connection is over; nothing comes back."""
        self._ended("closed")

    def interrupted(self) -> None:
        """The connection was lost and is being made anew."""
        self._ended("reconnecting")

    def disconnected(self, *, comes_back: bool) -> None:
        """The connection is gone; ``comes_back``: it is being made anew."""
        if comes_back:
            self.interrupted()
        else:
            self.closed()

    def _ended(self, phase: Literal["closed", "reconnecting"]) -> None:
        was_open = self.state.phase == "open"
        self._enter(StoreState(phase))
        if was_open:
            self._moment("after_disconnected")

    def missed(self, lost: int | None, *, sent: bool) -> None:
        """``lost`` messages (``None``: nobody knows how many) got lost across a reconnection."""
        if self.warns_of_gaps:
            label = self.robot_connector.connector_id
            what = "messages" if lost is None else f"{lost} message(s)"
            _log.warning("%r: %s %s lost while there was no connection", label, what, "sent were" if sent else "were")
        self._gap_listeners.tell(Gap(lost, sent))

    def failed(self, error: MosaicError, nearest: str | None = None) -> None:
        """The channel or track could not be opened; ``nearest`` is the label that may be meant."""
        is_mismatch = error.code == "channel.unknown_label"
        phase: Literal["mismatch", "closed"] = "mismatch" if is_mismatch else "closed"
        self._enter(StoreState(phase, error.code, error.message, nearest, error.cure))
        self._moment("after_connection_failed")

    def _enter(self, state: StoreState) -> None:
        self.state = state
        self._changed.set()

    def _moment(self, moment: StoreMoment) -> None:
        self._listeners[moment].tell()

    def _own_listeners(self, moment: StoreMoment) -> Listeners[[]]:
        """Those of the class itself, who hear of it first."""
        listeners: Listeners[[]] = Listeners()
        listeners.add(getattr(self, moment))
        if getattr(type(self), f"on_{moment}") is not getattr(MosaicStore, f"on_{moment}"):
            listeners.add(getattr(self, f"on_{moment}"))
        return listeners
