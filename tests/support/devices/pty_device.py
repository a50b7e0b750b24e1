"""A device at the other end of a pseudo terminal."""

from __future__ import annotations

import os
import select
import tty
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any

import pytest

import mosaic_sensors.byte_source
from support.waiting import wait_for

NAME = "/dev/ttyTEST"
"""Where a device is plugged in, whichever it is."""


class PtyDevice:
    """Speaks and listens at one end; ``port`` is the name of the other, and :data:`NAME` leads to it, too. What is said
    before anybody has opened the port is lost, as on a real line: ``greeting`` is said as soon as somebody has, and is
    there before the first read: what comes in pieces is thinned otherwise."""

    def __init__(self) -> None:
        self._ours, self._theirs = os.openpty()
        tty.setraw(self._theirs)
        self.port = os.ttyname(self._theirs)
        self.greeting = b""
        self.bauds: list[int] = []

    def says(self, data: bytes) -> None:
        os.write(self._ours, data)

    def heard(self) -> bytes:
        """All that was written to it so far."""
        data = b""
        while select.select([self._ours], [], [], 0)[0]:
            data += os.read(self._ours, 65_536)
        return data

    def unplug(self) -> None:
        for descriptor in (self._ours, self._theirs):
            if descriptor >= 0:
                os.close(descriptor)
        self._ours = self._theirs = -1

    def opened(self, make: Any, port: str, baud: int, **options: Any) -> Any:
        made = make(self.port if port == NAME else port, baud, **options)
        self.bauds.append(baud)
        if self.greeting:
            self.says(self.greeting)
            wait_for(lambda: made.in_waiting >= len(self.greeting), "the greeting is there, whole")
        return made


@contextmanager
def plugged_in(monkeypatch: pytest.MonkeyPatch) -> Iterator[PtyDevice]:
    """A device that can be opened by its port. Reads of a silent one come back soon: no test waits for them. Writes
    have time: a busy machine may keep a thread from running for longer than a device may keep a robot."""
    device, make = PtyDevice(), mosaic_sensors.byte_source.serial.Serial
    with monkeypatch.context() as patch:
        patch.setattr(mosaic_sensors.byte_source, "READ_TIMEOUT_S", 0.01)
        patch.setattr(mosaic_sensors.byte_source, "WRITE_TIMEOUT_S", 10.0)
        patch.setattr(mosaic_sensors.byte_source.serial, "Serial", partial(device.opened, make))
        try:
            yield device
        finally:
            device.unplug()
