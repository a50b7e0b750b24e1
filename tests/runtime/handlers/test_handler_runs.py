"""Handlers run when they shall, their commands and failures are counted and told, and at the end what moves is stopped
before anything else ends."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import pytest
from support.connectors import Camera, Motor

from mosaic_core import DataChannelSendable
from mosaic_core.contract.handler import Handler, Refused
from mosaic_core.contract.host import Outgoing, Sender
from mosaic_core.laboratory.memory_network import memory_picture
from mosaic_core.machines.delivery.send_scheduler import Offered
from mosaic_core.runtime.commands.inbox import Incoming
from mosaic_core.runtime.commands.link_watch import LinkWatch
from mosaic_core.runtime.handlers import handler_runs
from mosaic_core.runtime.handlers.handler_runs import HandlerRuns
from mosaic_core.runtime.handlers.receiver import Outcome
from mosaic_core.runtime.media.plain_stream import plain_streams

ANN = Sender("ann", "s")


class Body(DataChannelSendable[str]):
    """Its body waits for its end. ``log``: when it began and ended."""

    runs = "watched"

    def __init__(self, label: str, log: list[str] | None = None) -> None:
        super().__init__(label)
        self.log = [] if log is None else log

    async def messages(self) -> AsyncIterator[str]:
        self.log.append(f"{self.label} began")
        try:
            while True:
                await asyncio.sleep(60)
                yield ""
        finally:
            self.log.append(f"{self.label} ended")


class Always(Body):
    runs = "always"


class CloudChannel(DataChannelSendable[bytes]):
    """A channel for original dashboards beside the first handler's."""

    is_for_originals = True


class Broken(DataChannelSendable[str]):
    """Its body fails at once."""

    async def messages(self) -> AsyncIterator[str]:
        raise OSError("unplugged")
        yield ""


class Careful(Motor):
    def handle_data(self, data: dict[str, Any]) -> None:
        if data["v"] > 1:
            raise Refused("motor.too_much")
        super().handle_data(data)


class Listener:
    """What was told."""

    def __init__(self) -> None:
        self.outcomes: list[Outcome] = []
        self.failed: list[tuple[str, str]] = []

    def command_done(self, outcome: Outcome) -> None:
        self.outcomes.append(outcome)

    def connector_failed(self, label: str, error: BaseException, restart_in_s: float) -> None:
        self.failed.append((label, str(error)))

    def talking_changed(self, label: str, who: Sender | None) -> None: ...


class Peer:
    """Listens to everything it joins."""

    def deliver(self, message: Outgoing) -> Offered:
        return Offered.QUEUED

    def waiting(self, channel: str) -> tuple[int, int]:
        return 3, 300


class Scene:
    def __init__(self, kit: Any, *groups: tuple[Handler, ...]) -> None:
        self.listener, self.peer, self.until = Listener(), Peer(), kit.until
        connectors = [kit.connector_of(*handlers) for handlers in groups]
        self.runs = HandlerRuns(connectors, plain_streams(memory_picture), self.listener, LinkWatch())

    def row(self, label: str, **limit_factors: float) -> Any:
        return next(row for row in self.runs.snapshot(limit_factors) if row.label == label)

    def hears(self, label: str) -> None:
        self.runs.outbox.join(label, "ann", self.peer)

    def leaves(self, label: str) -> None:
        self.runs.outbox.leave(label, "ann")

    def command(self, payload: bytes) -> None:
        receiver = self.runs.routes["drive"].receiver
        assert receiver is not None
        opening = receiver.channel_opened(ANN)
        now_s = asyncio.get_running_loop().time()
        receiver.accept(Incoming("drive", payload, ANN, 1, now_s, opening=opening))


@asynccontextmanager
async def running(kit: Any, *groups: tuple[Handler, ...]) -> AsyncIterator[Scene]:
    scene = Scene(kit, *groups)
    scene.runs.start()
    try:
        yield scene
    finally:
        await scene.runs.close()


# -- when bodies run


async def test_a_body_runs_while_somebody_listens_or_always(kit: Any) -> None:
    watched, always = Body("pose"), Always("log")
    async with running(kit, (watched,), (always,)) as scene:
        await scene.until(lambda: always.log)
        assert watched.log == []
        assert scene.row("pose").state == "waiting"
        scene.hears("pose")
        scene.hears("log")
        await scene.until(lambda: watched.log == ["pose began"])
        scene.leaves("pose")
        scene.leaves("log")
        await scene.until(lambda: watched.log == ["pose began", "pose ended"])
        assert always.log == ["log began"], "once, whoever comes and goes"
        assert scene.row("log").state == "running"
    assert always.log == ["log began", "log ended"]


async def test_a_connector_with_channels_for_originals_runs_while_any_of_them_is_heard(kit: Any) -> None:
    body = Body("cloud")
    channel = CloudChannel("cloud_1")
    async with running(kit, (body, channel)) as scene:
        scene.hears("cloud_1")
        await scene.until(lambda: body.log == ["cloud began"])
        scene.hears("cloud")
        scene.leaves("cloud_1")
        await asyncio.sleep(0)
        assert body.log == ["cloud began"]
        scene.leaves("cloud")
        await scene.until(lambda: body.log == ["cloud began", "cloud ended"])


# -- commands and failures


async def test_a_command_is_counted_and_told_whether_it_acted_or_was_refused(kit: Any) -> None:
    motor = Careful()
    async with running(kit, (motor,)) as scene:
        scene.command(b'{"v": 1}')
        await scene.until(lambda: len(scene.listener.outcomes) == 1)
        scene.command(b'{"v": 2}')
        await scene.until(lambda: len(scene.listener.outcomes) == 2)
        row = scene.row("drive", drive=0.25, other=0.1)
    assert [outcome.refusal is not None for outcome in scene.listener.outcomes] == [False, True]
    assert (row.messages, row.size_bytes, row.refused, row.limit_factor) == (1, len(b'{"v": 1}'), 1, 0.25)
    assert row.age_s is not None
    assert motor.log[0] == 1


async def test_a_body_that_fails_is_told_with_its_label_and_stands_in_its_row(kit: Any) -> None:
    async with running(kit, (Broken("gps"),), (Body("pose"),)) as scene:
        scene.hears("gps")
        await scene.until(lambda: scene.listener.failed)
        assert scene.listener.failed == [("gps", "unplugged")]
        row = scene.row("gps")
        assert (row.state, row.failures) == ("failed", 1)
        assert "unplugged" in row.last_error
        assert (scene.row("pose").state, scene.row("pose").failures, scene.row("pose").last_error) == ("waiting", 0, "")


# -- the rows


async def test_there_is_a_row_per_connector_in_the_order_of_the_file(kit: Any) -> None:
    async with running(
        kit, (Body("pose"),), (Motor(),), (Camera("front"),), (Body("cloud"), CloudChannel("cloud_1"))
    ) as scene:
        rows = scene.runs.snapshot({})
        assert [row.label for row in rows] == ["pose", "drive", "front", "cloud"]
        assert [row.kind for row in rows] == ["data", "data", "video", "data"]
        assert {row.type for row in rows} == {"test"}
        assert [row.state for row in rows] == ["waiting", "running", "running", "running"]
        assert all(row.limit_factor is None and row.age_s is None for row in rows)
        scene.hears("cloud_1")
        row = scene.row("cloud")
        assert (row.peers, row.queue_messages, row.queue_bytes) == (1, 3, 300), "of all its channels"
        assert (scene.row("pose").peers, scene.row("pose").queue_messages) == (0, 0)


async def test_what_a_handler_leaves_out_itself_is_in_its_row(kit: Any) -> None:
    body = Body("pose")
    async with running(kit, (body,)) as scene:
        counts = {"replaced": 1, "dropped": 2, "too_large": 3, "thinned": 4, "refused": 5, "lost": 6}
        for reason, count in counts.items():
            body.count_loss(reason, count)  # type: ignore[arg-type]
        row = scene.row("pose")
        assert {reason: getattr(row, reason) for reason in counts} == counts


# -- the end


async def test_at_the_end_what_moves_is_stopped_before_any_body_ends(kit: Any) -> None:
    motor = Motor()
    log: list[Any] = motor.log
    always = Always("log", log)
    async with running(kit, (motor,), (always,)) as scene:
        await scene.until(lambda: log)
    assert log == ["log began", "safety.shutdown", "log ended"]


async def test_a_safe_action_that_hangs_at_the_end_is_told(
    kit: Any, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(handler_runs, "_SAFE_PATIENCE_S", 0.01)
    motor = Motor()
    motor.may_stop.clear()
    with caplog.at_level(logging.ERROR):
        async with running(kit, (motor,)):
            pass
    motor.may_stop.set()
    assert "did not end within 0.0 s" in caplog.text


async def test_without_receivers_no_thread_is_asked_for_safety(kit: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = Scene(kit, (Body("pose"),))
    scene.runs.start()
    monkeypatch.setattr(scene.runs.safety, "make_safe", None)
    await scene.runs.close()
    assert scene.row("pose").state == "stopped"


class AsyncMotor(Motor):
    async def handle_data(self, data: dict[str, Any]) -> None:
        self.log.append(data["v"])


@pytest.mark.parametrize("kind", [Motor, AsyncMotor])
async def test_what_is_held_is_made_safe_and_commanded_no_more_until_it_goes_on(kit: Any, kind: type[Motor]) -> None:
    motor = kind()
    async with running(kit, (motor,)) as scene:
        connectors = [kit.connector_of(motor)]
        scene.command(b'{"v": 1}')
        await scene.until(lambda: scene.row("drive").messages == 1)  # it has returned
        await scene.runs.hold(connectors)
        assert motor.log == [1, "safety.reload"]
        scene.command(b'{"v": 2}')
        await asyncio.sleep(0)
        assert motor.log == [1, "safety.reload"]
        scene.runs.resume(connectors)
        await scene.until(lambda: motor.log == [1, "safety.reload", 2])
