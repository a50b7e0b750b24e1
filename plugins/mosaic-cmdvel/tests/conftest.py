"""Drives whose every step a test controls."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Self

import pytest

from mosaic_cmdvel import Drive, DriveParams
from mosaic_core.contract.devices.shared import Shared
from mosaic_core.contract.host import Sender
from mosaic_core.messages import STANDSTILL, Twist

IN_TIME_S = 5.0


class ScriptedDrive(Drive[DriveParams]):
    """Remembers what it is told; opening, applying and stopping fail or hang on command."""

    def __init__(self) -> None:
        super().__init__(DriveParams(type="scripted"), Shared())
        self.velocity = STANDSTILL
        self.commands: list[Twist] = []
        self.opened = 0
        self.closed = 0
        self.open_error: Exception | None = None
        self.apply_error: Exception | None = None
        self.stop_error: Exception | None = None
        self.hang: threading.Event | None = None
        self.moves_before_hanging = False
        self._happened = threading.Condition()
        self.hanging = threading.Event()
        self.stops = 0

    def __enter__(self) -> Self:
        if self.open_error is not None:
            self._note(lambda: setattr(self, "opened", self.opened + 1))
            raise self.open_error
        self._note(lambda: setattr(self, "opened", self.opened + 1))
        return self

    def __exit__(self, *_: object) -> None:
        self._note(lambda: setattr(self, "closed", self.closed + 1))

    def apply(self, twist: Twist) -> None:
        if self.apply_error is not None:
            raise self.apply_error
        self.commands.append(twist)
        if self.hang is not None:
            if self.moves_before_hanging:
                self.velocity = twist
            self.hanging.set()
            assert self.hang.wait(IN_TIME_S)
        self.velocity = twist

    def stop(self) -> None:
        if self.stop_error is not None:
            raise self.stop_error
        self.velocity = STANDSTILL
        self._note(lambda: setattr(self, "stops", self.stops + 1))

    def _note(self, change: Callable[[], None]) -> None:
        with self._happened:
            change()
            self._happened.notify_all()

    def wait_for(self, condition: Callable[[], bool]) -> bool:
        """Until ``condition`` of this drive's counters holds."""
        with self._happened:
            return self._happened.wait_for(condition, IN_TIME_S)


@pytest.fixture
def drive() -> ScriptedDrive:
    return ScriptedDrive()


@pytest.fixture
def alice() -> Sender:
    return Sender(peer_id="peer-alice", session_id="session-alice")


@pytest.fixture
def bob() -> Sender:
    return Sender(peer_id="peer-bob", session_id="session-bob")
