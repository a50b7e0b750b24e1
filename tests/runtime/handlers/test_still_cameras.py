"""A camera that hangs while somebody watches is told once with its line, and once more when it goes on."""

from __future__ import annotations

import asyncio
import logging
import threading
from collections.abc import AsyncIterator, Iterator
from typing import Any

import numpy as np
import pytest

from mosaic_core import MediaTrackHandler
from mosaic_core.contract.host import Sender
from mosaic_core.laboratory.memory_network import memory_picture
from mosaic_core.runtime.commands.link_watch import LinkWatch
from mosaic_core.runtime.handlers import still_cameras
from mosaic_core.runtime.handlers.handler_runs import HandlerRuns
from mosaic_core.runtime.handlers.receiver import Outcome
from mosaic_core.runtime.media.plain_stream import plain_streams

PICTURE = np.zeros((4, 6, 3), np.uint8)


class Hangs(MediaTrackHandler):
    """Gives a picture, and then none until it may."""

    def __init__(self) -> None:
        super().__init__("front")
        self.may = threading.Event()

    def allow(self) -> None:
        self.may.set()

    def frames(self) -> Iterator[Any]:
        yield PICTURE
        self.may.wait()  # the line to blame
        for _ in self.every(0.005):
            yield PICTURE


class HangsAsTask(MediaTrackHandler):
    def __init__(self) -> None:
        super().__init__("front")
        self.may = asyncio.Event()

    def allow(self) -> None:
        self.may.set()

    async def frames(self) -> AsyncIterator[Any]:
        yield PICTURE
        await self.may.wait()  # the line to blame
        async for _ in self.every(0.005):
            yield PICTURE


class Rests(MediaTrackHandler):
    def frames(self) -> Iterator[Any]:
        for _ in self.every(60):
            yield PICTURE


class Polls(MediaTrackHandler):
    def frames(self) -> Iterator[Any]:
        yield PICTURE
        while not self.pause(0.002):
            pass


class Pushes(MediaTrackHandler):
    def frames(self) -> Iterator[Any]:
        while not self.is_stopping:
            self.send_frame(PICTURE)
            threading.Event().wait(0.002)
        yield PICTURE


class Nobody:
    def command_done(self, outcome: Outcome) -> None: ...
    def connector_failed(self, label: str, error: BaseException, restart_in_s: float) -> None: ...
    def talking_changed(self, label: str, who: Sender | None) -> None: ...


@pytest.fixture(autouse=True)
def _soon(monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture) -> None:
    monkeypatch.setattr(still_cameras, "STILL_S", 0.1)
    monkeypatch.setattr(still_cameras, "PERIOD_S", 0.01)
    caplog.set_level(logging.INFO, still_cameras.__name__)


def watched(kit: Any, handler: MediaTrackHandler) -> HandlerRuns:
    runs = HandlerRuns([kit.connector_of(handler)], plain_streams(memory_picture), Nobody(), LinkWatch())
    runs.start()
    runs.media.bind("ann", handler.label, lambda code: None)
    runs.media.watch("ann", handler.label, True)
    return runs


@pytest.mark.parametrize("kind", [Hangs, HangsAsTask])
async def test_it_is_told_with_its_line_and_once_more_when_it_goes_on(
    kit: Any, kind: Any, caplog: pytest.LogCaptureFixture
) -> None:
    handler = kind()
    runs = watched(kit, handler)
    await kit.until(lambda: caplog.messages)
    handler.allow()
    await kit.until(lambda: len(caplog.messages) > 1)
    await runs.close()
    line = kind.frames.__code__.co_firstlineno + 2
    place = f"{__file__}:{line} in {kind.__name__}.frames"
    assert caplog.messages == [
        f"camera 'front' is watched and has given no picture for 0 s (media.not_sent); its body is at {place}",
        "camera 'front' gives pictures again",
    ]


@pytest.mark.parametrize("kind", [Rests, Polls, Pushes])
async def test_who_rests_between_pictures_or_pushes_them_is_not_accused(
    kit: Any, kind: Any, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    looks: list[str] = []
    look = still_cameras.StillCameras._look
    monkeypatch.setattr(still_cameras.StillCameras, "_look", lambda self: (look(self), looks.append("")))
    runs = watched(kit, kind("front"))
    await kit.until(lambda: len(looks) > 20)
    await runs.close()
    assert caplog.messages == []


async def test_nobody_is_told_of_a_camera_that_nobody_watches(
    kit: Any, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    looks: list[str] = []
    look = still_cameras.StillCameras._look
    handler = Hangs()
    runs = watched(kit, handler)
    await kit.until(lambda: caplog.messages)
    runs.media.watch("ann", "front", False)
    monkeypatch.setattr(still_cameras.StillCameras, "_look", lambda self: (look(self), looks.append("")))
    handler.allow()
    await kit.until(lambda: len(looks) > 3)
    await runs.close()
    assert len(caplog.messages) == 1
