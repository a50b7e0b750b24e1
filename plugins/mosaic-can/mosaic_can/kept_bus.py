"""Keeps one bus open for all connectors that name it: one thread reads it and hands frames to its listeners.

Three threads meet here: the *bus's* opens, reads and closes, a *receiver's* sends commands, the robot's *safety* thread
sends safe frames. A bus that is opened begins with the safe frames, and one that is closed ends with them: a controller
may still carry out what a crashed program told it.
"""

from __future__ import annotations

import logging
import re
import threading
from collections.abc import Callable

import can

from mosaic_can.databases import CanDatabase
from mosaic_can.listener import CanListener, Wanted
from mosaic_can.opening import SEND_TIMEOUT_S, OpenBus, opened_bus
from mosaic_can.params import CanBusParams
from mosaic_core.contract.devices.keeper import Keeper
from mosaic_core.contract.devices.kept_device import KeptDevice
from mosaic_core.contract.devices.shared import Shared
from mosaic_core.machines.timing.backoff import BackoffPolicy
from mosaic_core.words.errors import DeviceGone, Refused

_log = logging.getLogger(__name__)

READ_TIMEOUT_S = 0.05
RETRY = BackoffPolicy(first_s=0.2, max_s=2.0, jitter=0.0)
"""Waits between attempts to open a bus. An adapter that is plugged in is back in seconds."""
CLOSE_TIMEOUT_S = 1.5
ERROR_BUS_OFF, ERROR_RESTARTED = 0x40, 0x100
"""Classes of error frames, as ``linux/can/error.h`` numbers them."""
Opens = Callable[[CanBusParams, CanDatabase], OpenBus]
MakesFrame = Callable[[], can.Message]
_LOST = (can.CanError, OSError, ValueError)
"""What python-can raises where a bus can't be opened or is lost; ValueError for an adapter's words."""


class KeptCanBus(KeptDevice):
    """One bus. Its keeper says whether it is away."""

    def __init__(self, params: CanBusParams, opens: Opens = opened_bus) -> None:
        """Opens nothing. Raises :class:`MosaicError` for DBC files that can't be used."""
        self.params = params
        self.database = CanDatabase(params.dbc)
        self.error_frames = 0
        self._opens = opens
        self._bus: OpenBus | None = None
        self._listeners: list[CanListener] = []
        self._safe: list[MakesFrame] = []
        self._owed: set[MakesFrame] = set()
        self._lock = threading.RLock()
        self.keeper = Keeper("can-bus", self._turn, patience_s=CLOSE_TIMEOUT_S, retry=RETRY)

    # -- for connectors ----------------------------------------------------------------------------------------------

    def listener(self, wants: Wanted = lambda frame: True) -> CanListener:
        """A new listener, for as long as the bus lives."""
        made = CanListener(wants)
        self._listeners.append(made)
        return made

    def begins_and_ends_with(self, frame: MakesFrame) -> None:
        """Send this frame when the bus is opened, comes back, or is closed."""
        self._safe.append(frame)

    def require(self) -> None:
        """Raises :class:`DeviceGone` while the bus is away. Any thread."""
        absence = self.keeper.absence
        if absence is not None:
            raise DeviceGone(absence.message)

    def send(self, frame: can.Message) -> None:
        """Send a command now. Any thread; waits at most for 0.05 s, and for one other that waits. Raises
        :class:`Refused` (``plugin.no_device``)."""
        with self._lock:
            if self._owed:
                raise Refused("plugin.no_device", f"{self.params.name}: the safe frames have not gone out yet")
            self._send(frame)

    def make_safe(self, frame: MakesFrame) -> None:
        """Send this safe frame now; while the bus is away nothing, for its return begins with it. Safety thread. Raises
        :class:`Refused` where it finds no room: the robot tries again."""
        with self._lock:
            if self._bus is not None and self.keeper.absence is None:
                self._send(frame())

    def _send(self, frame: can.Message) -> None:
        absence = self.keeper.absence
        if self._bus is None or absence is not None:
            why = "it is not open yet" if absence is None else absence.message
            raise Refused("plugin.no_device", f"{self.params.name}: {why}")
        try:
            self._bus.send(frame, timeout=SEND_TIMEOUT_S)
        except _LOST as error:
            message = f"{self.params.name} took nothing: {error}; is another node switched on and connected?"
            raise Refused("plugin.no_device", message) from error

    # -- the bus's own thread ----------------------------------------------------------------------------------------

    def _turn(self) -> float:
        self.open()
        while not self.keeper.is_stopping and self.step():
            pass
        self.close()
        return self.keeper.failed()

    def open(self) -> None:
        """Open it and send the safe frames. Raises :class:`DeviceGone`."""
        try:
            bus = self._opens(self.params, self.database)
        except Exception as error:  # drivers raise whatever comes of their options
            raise DeviceGone(f"{self.params.name} can't be opened: {error}", _cure_of(error)) from error
        self._come_back(bus)

    def _come_back(self, bus: OpenBus | None) -> None:
        """It can be used: the safe frames go first."""
        with self._lock:
            self._owed = set(self._safe)
            self._bus = bus
        self.keeper.worked()  # without the lock, which a safe action wants
        self._pay()

    def step(self, timeout_s: float = READ_TIMEOUT_S) -> bool:
        """Read one frame and hand it on; ``False`` when the bus is lost."""
        assert self._bus is not None
        try:
            frame = self._bus.recv(timeout_s)
            if frame is None:
                self._look_at_state(self._bus)
        except Exception as error:  # noqa: BLE001 - drivers raise whatever comes of an adapter's bytes: IndexError of "t12"
            self._lose(f"{self.params.name} is lost: {error}", "opening it again")
            return False
        if self._owed:
            self._pay()
        if frame is not None:
            self._take(frame)
        return self._bus is not None

    def _look_at_state(self, bus: OpenBus) -> None:
        """Adapters that send no error frames say so. Raises :class:`can.CanError`."""
        try:
            state = bus.state
        except NotImplementedError:
            return
        if state is can.BusState.ERROR:
            raise can.CanOperationError("its controller has switched itself off (bus-off)")

    def _take(self, frame: can.Message) -> None:
        if not frame.is_error_frame:
            self._restarted()
            for one in self._listeners:
                one.offer(frame)
        elif frame.arbitration_id & ERROR_RESTARTED:
            self._restarted()
        elif frame.arbitration_id & ERROR_BUS_OFF:
            cure = "look at its wires, terminators and bit rate; `ip link set can0 type can restart-ms 100` restarts it"
            self._lose(f"{self.params.name} is bus-off: too many errors", cure)
        else:
            self.error_frames += 1

    def _restarted(self) -> None:
        if self.keeper.absence is not None:
            self._come_back(self._bus)

    def _lose(self, message: str, cure: str) -> None:
        self.keeper.lost(DeviceGone(message, cure))
        for one in self._listeners:
            one.forget()

    def _pay(self) -> None:
        """Send the safe frames that are owed; what finds no room is owed further."""
        with self._lock:
            for make in tuple(self._owed):
                try:
                    self._send(make())
                except Refused:
                    return
                self._owed.discard(make)

    def close(self) -> None:
        """Send the safe frames, if there is a way, and close it."""
        with self._lock:
            bus, self._bus = self._bus, None  # first: no command comes after the last frame
        if bus is None:
            return
        try:
            if self.keeper.absence is None:
                for make in self._safe:
                    bus.send(make(), timeout=SEND_TIMEOUT_S)
        except _LOST as error:
            _log.warning("%s: the safe frame did not go out: %s", self.params.name, error)
        try:
            bus.shutdown()
        except _LOST as error:
            _log.debug("%s: %s", self.params.name, error)


def _cure_of(error: Exception) -> str:
    """python-can leaves out what only one of its interfaces needs, and says so when that one is opened."""
    missing = re.search(r"([\w-]+) not installed", str(error))
    return f"pip install {missing[1]}" if missing else "is the adapter there, and its interface up?"


def shared_bus(params: CanBusParams, shared: Shared) -> KeptCanBus:
    """The bus of ``params``, the same for all who ask. Raises :class:`MosaicError` (``config.invalid``) where two
    connectors describe it differently."""
    key = f"mosaic-can:{params.interface}:{params.channel}"
    return shared.agreed(key, lambda: KeptCanBus(params), params, f"the bus {params.name}")
