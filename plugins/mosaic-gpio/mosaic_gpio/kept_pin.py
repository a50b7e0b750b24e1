"""Keeps a pin that drives something: opened with the robot in its safe state, opened again when it was lost."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from typing import Any, Self

from mosaic_core import DeviceGone, Keeper, Refused
from mosaic_core.contract.devices.keeper import RETRY
from mosaic_gpio.factories import PinParams, opening

_log = logging.getLogger(__name__)


class KeptPin:
    """One device of gpiozero. Enter it with the robot (``Shared``); entering never fails and never blocks.

    :meth:`write` and :attr:`value` may be used from any thread; they take as long as one write to the pin.
    """

    def __init__(self, params: PinParams, make: Callable[[], Any], field: str, safe: float | None) -> None:
        """``make`` opens the device in its safe state; ``field`` is the attribute of it that is written, to ``safe``
        before it is closed, if that is not ``None``."""
        self.params = params
        self._make = make
        self._field = field
        self._safe = safe
        self._lock = threading.Lock()
        self._device: Any = None
        self._problem = f"{params.place} is not open yet"
        """Not the error itself: its traceback would keep a device that was half opened, and the pin with it."""
        self._opened = threading.Event()
        self._was_told = False
        self._keeper = Keeper(f"mosaic-{params.place}", self._turn, retry=RETRY)

    @property
    def value(self) -> float | None:
        """What was written last; ``None`` while the pin is away or drives nothing."""
        with self._lock:
            value = None if self._device is None else getattr(self._device, self._field)
        return None if value is None else float(value)

    def wait_open(self, timeout_s: float) -> bool:
        """Block until commands are taken; ``False`` when that took too long."""
        return self._opened.wait(timeout_s)

    def write(self, value: float) -> None:
        """Raises :class:`Refused` (``plugin.no_device``) while the pin is away."""
        with self._lock:
            if self._device is None:
                raise Refused("plugin.no_device", self._problem)
            try:
                with opening(self.params):
                    setattr(self._device, self._field, value)
            except DeviceGone as gone:
                self._lost(gone)
                raise Refused("plugin.no_device", gone.message) from gone

    def make_safe(self, value: float) -> None:
        """Write it, if the pin is there: one that comes back begins in its safe state."""
        try:
            self.write(value)
        except Refused:
            return

    def __enter__(self) -> Self:
        self._was_told = False
        self._keeper.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._keeper.stop()

    def _turn(self) -> float:
        """Open it and wait until it is lost, or the robot ends."""
        try:
            with opening(self.params):
                device = self._make()
        except DeviceGone as gone:
            self._problem = gone.message
            if not self._was_told:
                _log.warning("%s Trying again.", gone.message)
            self._was_told = True
            return self._keeper.failed()
        if self._was_told:
            _log.warning("%s is back", self.params.place)
        with self._lock:
            self._device = device
        self._opened.set()
        self._keeper.worked()
        self._keeper.wait()
        self._close(device)
        self._was_told = True
        return 0.0

    def _lost(self, gone: DeviceGone) -> None:
        """Locked."""
        _log.warning("%s; opening it again", gone.message)
        self._device, self._problem = None, gone.message
        self._opened.clear()
        self._keeper.wake()

    def _close(self, device: Any) -> None:
        with self._lock:
            self._device = None
            self._opened.clear()
            try:
                with opening(self.params):
                    if self._safe is not None:
                        setattr(device, self._field, self._safe)
            except DeviceGone as gone:
                _log.warning("%s, when it was closed", gone.message)
            try:
                with opening(self.params):
                    device.close()
            except DeviceGone as gone:
                _log.warning("%s, when it was closed", gone.message)


def shared_pin(shared: Any, params: PinParams, label: str, make: Callable[[], KeptPin]) -> KeptPin:
    """The pin of this connector, which outlives a restart of its handler."""
    kept: KeptPin = shared.get(f"mosaic-gpio:{label}:{params.place}", make)
    return kept
