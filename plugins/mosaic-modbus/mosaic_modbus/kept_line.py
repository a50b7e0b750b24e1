"""Keeps one line to devices open for all connectors that name it.

Its own thread opens it, opens it again when it is lost, and writes the safe values that are owed; requests run on the
threads of those who ask. A line that is opened begins with the safe values, and one that is closed ends with them: a
drive may still carry out what a crashed program told it.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from typing import Protocol, TypeVar

from mosaic_core.contract.devices.keeper import Keeper
from mosaic_core.contract.devices.kept_device import KeptDevice
from mosaic_core.contract.devices.shared import Shared
from mosaic_core.machines.timing.backoff import BackoffPolicy
from mosaic_core.words.errors import DeviceGone
from mosaic_modbus.fake_port import FakeModbusPort
from mosaic_modbus.params import FAKE, ModbusLineParams
from mosaic_modbus.plan import Block, Write
from mosaic_modbus.port import DeviceSaidNo, ModbusPort, NoAnswer, PymodbusPort
from mosaic_modbus.turns import Turns

_log = logging.getLogger(__name__)

RETRY = BackoffPolicy(first_s=0.2, max_s=2.0, jitter=0.0)
"""Waits between attempts to open a line."""
OWED_S = 0.2
"""Safe values that a device did not take are written again so often."""
CLOSE_TIMEOUT_S = 5.0
Opens = Callable[[ModbusLineParams], ModbusPort]
Answer = TypeVar("Answer")


class SafeValues(Protocol):
    """What writes into devices, and can make them safe."""

    owes: bool

    def pay(self) -> None:
        """Write the safe values. Raises what requests raise."""
        ...


def port_of(params: ModbusLineParams) -> ModbusPort:
    """What carries requests there; it is not open."""
    return FakeModbusPort() if params.source == FAKE else PymodbusPort(params)


class KeptLine(KeptDevice):
    """One line. Its keeper says whether it is away."""

    def __init__(self, params: ModbusLineParams, opens: Opens = port_of) -> None:
        """Opens nothing."""
        self.params = params
        self._opens = opens
        self._port: ModbusPort | None = None
        self._writers: list[SafeValues] = []
        self._turns = Turns()
        self.keeper = Keeper("modbus-line", self._turn, self.close, CLOSE_TIMEOUT_S, RETRY)

    @property
    def is_open(self) -> bool:
        return self._port is not None

    @property
    def waiting(self) -> int:
        """How many requests wait for their turn."""
        return self._turns.waiting

    def begins_and_ends_with(self, writer: SafeValues) -> None:
        """Make these devices safe when the line is opened, comes back, or is closed."""
        self._writers.append(writer)

    def read(self, device_id: int, block: Block) -> Sequence[int]:
        """What the device answers. One lost answer is asked for again. Raises :class:`DeviceSaidNo`,
        :class:`DeviceGone`. Any thread."""
        for is_last in (False, True):
            try:
                return self._asked(lambda port: port.read(device_id, block))
            except NoAnswer as error:
                if is_last:
                    raise self._silent(device_id, block, error) from error
        raise AssertionError("unreachable")

    def write(
        self, device_id: int, write: Write, *, urgently: bool = False, check: Callable[[], None] = lambda: None
    ) -> None:
        """Write once. ``check`` may refuse when its turn has come: what was urgent went first. Raises
        :class:`DeviceSaidNo`, :class:`DeviceGone`, and what ``check`` raises. Any thread."""

        def ask(port: ModbusPort) -> None:
            check()
            port.write(device_id, write)

        try:
            self._asked(ask, urgently=urgently)
        except NoAnswer as error:
            raise self._silent(device_id, write, error) from error

    def _silent(self, device_id: int, what: object, error: NoAnswer) -> DeviceGone:
        where = f"{self.params.source}: device {device_id} does not answer for {what}"
        return DeviceGone(f"{where} ({error})", "look at its supply, its number, and the speed of the line")

    def _asked(self, ask: Callable[[ModbusPort], Answer], *, urgently: bool = False) -> Answer:
        with self._turns.taken(urgently=urgently):
            port = self._port
            if port is None:
                absence = self.keeper.absence
                raise DeviceGone(absence.message if absence is not None else f"{self.params.source} is not open yet")
            try:
                return ask(port)
            except OSError as error:
                gone = DeviceGone(f"{self.params.source} is lost: {error}")
                self._drop()
                self.keeper.lost(gone)
                raise gone from error
            except NoAnswer:
                if "://" in self.params.source:  # what comes late would be taken for the next answer
                    self._drop()
                    self.keeper.wake()
                raise

    def _drop(self) -> None:
        port, self._port = self._port, None
        if port is not None:
            port.close()

    def wake(self) -> None:
        """A writer could not make its device safe: the line's thread goes on trying."""
        self.keeper.wake()

    # -- the line's own thread ---------------------------------------------------------------------------------------

    def _turn(self) -> float | None:
        if not self.is_open:
            self.open()
        self.keeper.worked()
        self.pay()
        if not self.is_open:
            return 0.0
        return OWED_S if any(one.owes for one in self._writers) else None

    def open(self) -> None:
        """Open it; every writer owes its safe values. Raises :class:`DeviceGone`."""
        port = self._opens(self.params)
        try:
            port.open()
        except OSError as error:
            port.close()
            cure = "is it there, and switched on?"
            raise DeviceGone(f"{self.params.source} can't be opened: {error}", cure) from error
        for one in self._writers:
            one.owes = True
        self._port = port

    def pay(self) -> None:
        """Write the safe values that are owed; what is not taken is owed further."""
        for one in self._writers:
            if one.owes:
                self._pay(one)

    def _pay(self, writer: SafeValues) -> None:
        try:
            writer.pay()
        except (DeviceGone, DeviceSaidNo) as error:
            _log.debug("%s: safe values are owed: %s", self.params.source, error)

    def close(self) -> None:
        """Write the safe values, if there is a way, and close it."""
        for one in self._writers:
            self._pay(one)
        with self._turns.taken(urgently=True):
            self._drop()


def shared_line(params: ModbusLineParams, shared: Shared) -> KeptLine:
    """The line of ``params``, the same for all who ask. Raises :class:`MosaicError` (``config.invalid``) where two
    connectors describe it differently."""
    key = f"mosaic-modbus:{params.source}"
    return shared.agreed(key, lambda: KeptLine(params), params, f"the line {params.source}")
