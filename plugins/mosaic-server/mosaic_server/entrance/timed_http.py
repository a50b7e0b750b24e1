"""uvicorn's HTTP protocol with the time-outs that it lacks: headers, bodies that stop coming, answers nobody takes; and
without bodies in crumbs."""

from __future__ import annotations

import asyncio
import re
import time
from collections.abc import Callable
from typing import Any, Protocol, runtime_checkable

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol

from mosaic_server.entrance.entrance import Entrance
from mosaic_server.entrance.places import EntrancePlace


@runtime_checkable
class Upgraded(Protocol):
    """The WebSocket that a connection has become keeps its place."""

    def entered(self, entrance: Entrance, place: EntrancePlace) -> None: ...


class _Deadline:
    """Ends a connection unless it is stopped in time."""

    def __init__(self) -> None:
        self._timer: asyncio.TimerHandle | None = None

    def start(self, transport: asyncio.Transport, within_s: float) -> None:
        self.stop()
        self._timer = asyncio.get_running_loop().call_later(within_s, transport.abort)

    def stop(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
        self._timer = None

    @property
    def runs(self) -> bool:
        return self._timer is not None


MOST_HEAD_BYTES = 16 * 1024
MOST_HEADERS = 100
"""Of one request. Each is read by Python on the event loop: 1 400 short ones in one head take ten milliseconds."""
_HEAD_ENDS = re.compile(rb"\n\r?\n")
CRUMBS = "a body (it comes in crumbs)"
FREE_PIECES = 64
LEAST_PIECE_BYTES = 512
"""On average, of the pieces beyond the free ones: each of them costs the event loop as much as a large one."""


class _Uncrumbled(h11.Connection):
    """Reads no head with too many headers, and no more of a body that comes in crumbs; ``given_up`` is told of these,
    and ends the connection."""

    def __init__(self, given_up: Callable[[], object]) -> None:
        super().__init__(h11.SERVER, MOST_HEAD_BYTES)
        self._given_up = given_up
        self._pieces = self._bytes = 0

    def next_event(self) -> h11.Event | type[h11.NEED_DATA] | type[h11.PAUSED]:
        """Raises :class:`h11.RemoteProtocolError`, which uvicorn answers with status 400."""
        if self.their_state is h11.IDLE and _headers_in(self.trailing_data[0]) > MOST_HEADERS:
            raise h11.RemoteProtocolError("too many headers", error_status_hint=431)
        event = super().next_event()
        if isinstance(event, h11.Request):
            self._pieces = self._bytes = 0
        elif isinstance(event, h11.Data):
            self._pieces += 1
            self._bytes += len(event.data)
            if self._pieces > FREE_PIECES + self._bytes // LEAST_PIECE_BYTES:
                self._given_up()
                return h11.NEED_DATA
        return event


def _headers_in(data: bytes) -> int:
    """Lines after the first one, up to the end of the head."""
    end = _HEAD_ENDS.search(data)
    return data.count(b"\n", 0, end.start() if end else len(data))


class TimedHttp(H11Protocol):
    """Serves one admitted connection until it ends or becomes a WebSocket. Event-loop thread only."""

    def __init__(self, entrance: Entrance, place: EntrancePlace, **uvicorns: Any) -> None:
        super().__init__(**uvicorns)
        self.conn = _Uncrumbled(self._give_up)
        self._entrance = entrance
        self._place = place
        self._header, self._body, self._unread = _Deadline(), _Deadline(), _Deadline()

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        super().connection_made(transport)
        self._place.close = transport.abort
        self._keep_time()

    def data_received(self, data: bytes) -> None:
        super().data_received(data)
        self._keep_time()

    def on_response_complete(self) -> None:
        super().on_response_complete()
        self._keep_time()

    def pause_writing(self) -> None:
        super().pause_writing()
        self._unread.start(self.transport, self._entrance.bounds.silence_s)

    def resume_writing(self) -> None:
        super().resume_writing()
        self._unread.stop()

    def connection_lost(self, exc: Exception | None) -> None:
        self._stop_deadlines()
        self._unset_keepalive_if_required()  # uvicorn leaves it running where the connection broke
        self._entrance.leave(self._place)
        super().connection_lost(exc)

    def handle_websocket_upgrade(self, event: h11.Request) -> None:
        super().handle_websocket_upgrade(event)
        self._stop_deadlines()
        self._place.is_busy = True
        upgraded = self.transport.get_protocol()
        assert isinstance(upgraded, Upgraded)
        upgraded.entered(self._entrance, self._place)

    def _keep_time(self) -> None:
        """Headers have one deadline, from their first byte or the connection's first moment on; a body may take long
        while it comes. Between two requests uvicorn's own timer runs."""
        if self.transport.get_protocol() is not self:
            return
        theirs, bounds = self.conn.their_state, self._entrance.bounds
        is_between = theirs is h11.IDLE and (self.cycle is None or self.cycle.response_complete)
        self._place.is_busy = not is_between
        is_waiting = self.timeout_keep_alive_task is not None and not self.conn.trailing_data[0]
        if not is_between or is_waiting:
            self._header.stop()
        elif not self._header.runs:
            self._header.start(self.transport, bounds.header_s)
        if theirs is h11.SEND_BODY and not self.flow.read_paused:
            self._body.start(self.transport, bounds.silence_s)
        else:
            self._body.stop()

    def _give_up(self) -> None:
        if not self.transport.is_closing():
            self._entrance.refusals.note(CRUMBS, self._place.address or "a proxy", time.monotonic())
            self.transport.abort()

    def _stop_deadlines(self) -> None:
        for deadline in (self._header, self._body, self._unread):
            deadline.stop()
