"""Keeps a pin that drives something: opened with the robot in its safe state, opened again when it was lost."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from typing import Any

from mosaic_core import DeviceGone, Keeper
from mosaic_core.contract.devices.keeper import RETRY
from mosaic_core.contract.devices.kept_device import KeptDevice
from mosaic_gpio.factories import PinParams, opening

_log = logging.getLogger(__name__)


class KeptPin(KeptDevice):
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
        self._opened = threading.Event()
        self.keeper = Keeper(f"mosaic-{params.place}", self._turn, retry=RETRY)

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
        """Raises :class:`DeviceGone` while the pin is away: one that comes back begins in its safe state."""
        with self._lock:
            if self._device is None:
                raise DeviceGone(f"{self.params.place} is not open yet")
            try:
                with opening(self.params):
                    setattr(self._device, self._field, value)
            except DeviceGone:
                self._device = None
                self._opened.clear()
                raise

    def _turn(self) -> float:
        """Open it and wait until it is lost, or the robot ends."""
        with opening(self.params):
            device = self._make()
        with self._lock:
            self._device = device
        self._opened.set()
        self.keeper.worked()
        self.keeper.wait()
        self._close(device)
        return 0.0

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
