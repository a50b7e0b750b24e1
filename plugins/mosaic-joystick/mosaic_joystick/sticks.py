"""Finds sticks: which there are, and which one is meant."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from mosaic_core import DeviceGone
from mosaic_joystick.event_device import EventDevice
from mosaic_joystick.fake_stick import FakeStick
from mosaic_joystick.stick_state import InputEvent, Stick, StickReading, StickState

INPUT = Path("/dev/input")
ANY, FAKE = "any", "fake"
"""The first stick that there is, and one that is made up."""


class OpenStick:
    """A stick that is open, and how it stands. One thread at a time."""

    def __init__(self, source: EventDevice | FakeStick, stick: Stick, dead_zone: float) -> None:
        self.stick = stick
        self._source = source
        self._state = StickState(stick, dead_zone)
        self._first: list[InputEvent] = source.standing()

    def read(self, now_s: float) -> StickReading:
        """How it stands now; never waits. Raises :class:`DeviceGone` when it is gone."""
        first, self._first = self._first, []
        self._state.take([*first, *self._source.events()], now_s)
        return self._state.reading(now_s)


def found_sticks() -> Iterator[Stick]:
    """All sticks of this machine that may be read, in the order in which they were plugged in."""
    for path in sorted(INPUT.glob("event*"), key=lambda path: (len(path.name), path.name)):
        with suppress(DeviceGone), EventDevice(str(path)) as device:
            stick = device.stick()
            if stick is not None:
                yield stick


def unreadable() -> list[str]:
    """Input devices that this account may not read: there may be sticks among them."""
    return [str(path) for path in sorted(INPUT.glob("event*")) if not os.access(path, os.R_OK)]


@contextmanager
def opened(wanted: str, dead_zone: float) -> Iterator[OpenStick]:
    """The stick that ``wanted`` means: ``any``, ``fake``, a path, or a part of its name. Raises :class:`DeviceGone`."""
    if wanted == FAKE:
        fake = FakeStick()
        yield OpenStick(fake, fake.stick(), dead_zone)
        return
    with EventDevice(wanted if wanted.startswith("/") else _path_of(wanted)) as device:
        stick = device.stick()
        if stick is None:
            raise DeviceGone(f"{wanted} is no stick", "See which there are: mosaic joystick list.")
        yield OpenStick(device, stick, dead_zone)


def _path_of(wanted: str) -> str:
    there = list(found_sticks())
    for stick in there:
        if wanted == ANY or wanted.lower() in stick.name.lower():
            return stick.path
    names = ", ".join(f"'{one.name}'" for one in there) or "none"
    shut = unreadable()
    cure = "Plug it in; mosaic joystick list shows which there are."
    if shut:
        cure = f"{len(shut)} input devices may not be read: sudo usermod -aG input $USER, and log in again."
    what = "there is no stick" if wanted == ANY else f"no stick is called '{wanted}'; there are: {names}"
    raise DeviceGone(what, cure)
