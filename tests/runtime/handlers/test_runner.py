"""Bodies on their own thread or as tasks: restarted with back-off, woken by stop, closed where they ran."""

from __future__ import annotations

import asyncio
import inspect
import logging
import threading
import time
from collections.abc import AsyncIterator, Callable, Iterator
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from mosaic_core import DataChannelSendable, Handler, MediaTrackHandler
from mosaic_core.laboratory.memory_network import memory_picture
from mosaic_core.machines.timing.backoff import BackoffPolicy
from mosaic_core.machines.timing.failure_course import FailureCourse
from mosaic_core.runtime.handlers.body import body_of, runner_of
from mosaic_core.runtime.handlers.handler_host import RuntimeHost
from mosaic_core.runtime.handlers.runner import Runner
from mosaic_core.runtime.media.media_hub import MediaHub
from mosaic_core.runtime.media.plain_stream import plain_streams
from mosaic_core.runtime.threads.failures import Failures
from mosaic_core.runtime.threads.handler_thread import STOP_PATIENCE_S

QUICK = BackoffPolicy(first_s=0.02, max_s=0.02, jitter=0.0)


class Setup:
    def __init__(self, handler: Handler) -> None:
        self.sent: list[bytes] = []
        self.failures: list[BaseException] = []
        outbox: Any = SimpleNamespace(post=self._post, is_heard=lambda channel: True)
        hub = MediaHub(plain_streams(memory_picture), lambda label, on: None)
        self.host = RuntimeHost(asyncio.get_running_loop(), outbox, hub)
        handler.bind(self.host)
        course = FailureCourse(QUICK, QUICK)
        told = Failures(handler.label, lambda label, error, delay_s: self.failures.append(error), course)
        runner = runner_of(handler, self.host, told)
        assert runner is not None
        self.runner: Runner = runner

    def _post(self, message: Any) -> bool:
        self.sent.append(message.payload)
        return True

    async def __aenter__(self) -> Setup:
        self.runner.start()
        self.runner.want(True)
        return self

    async def __aexit__(self, *_: object) -> None:
        self.runner.close()
        await self.runner.closed()
        assert self.runner.state == "stopped"


class Flaky(DataChannelSendable[str]):
    """Fails twice, then works; ``threads`` are those it ran on."""

    def __init__(self) -> None:
        super().__init__("flaky")
        self.attempts = 0
        self.threads: set[str] = set()

    def messages(self) -> Iterator[str]:
        self.attempts += 1
        self.threads.add(threading.current_thread().name)
        if self.attempts <= 2:
            raise OSError("unplugged")
        for number in self.every(0.005):
            yield str(number)


class FlakyTask(DataChannelSendable[str]):
    def __init__(self) -> None:
        super().__init__("flaky")
        self.attempts = 0
        self.is_closed = False

    async def messages(self) -> AsyncIterator[str]:
        self.attempts += 1
        if self.attempts <= 2:
            raise OSError("unplugged")
        try:
            async for number in self.every(0.005):
                yield str(number)
        finally:
            self.is_closed = True


@pytest.mark.parametrize("made", [Flaky, FlakyTask])
async def test_a_failing_body_restarts_and_is_logged_once_lost_and_once_back(
    kit: Any, made: Callable[[], Any], caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level("INFO", "mosaic_core")
    handler = made()
    async with Setup(handler) as setup:
        await kit.until(lambda: len(setup.sent) > 3)
        assert setup.runner.state == "running"
        assert handler.attempts == 3
        assert [str(error) for error in setup.failures] == ["unplugged", "unplugged"]
    assert [record.levelname for record in caplog.records if "unplugged" in record.message] == ["ERROR"]
    assert sum("is back" in record.message for record in caplog.records) == 1


class Wrong(DataChannelSendable[str]):
    def messages(self) -> Iterator[Any]:
        yield "good"
        yield 3


class WrongTask(DataChannelSendable[str]):
    async def messages(self) -> AsyncIterator[Any]:
        yield "good"
        yield 3


@pytest.mark.parametrize("kind", [Wrong, WrongTask])
async def test_what_is_not_declared_is_told_with_the_line_of_its_yield(kit: Any, kind: Any) -> None:
    async with Setup(kind("it")) as setup:
        await kit.until(lambda: setup.failures)
    line = kind.messages.__code__.co_firstlineno + 2
    assert str(setup.failures[0]) == f"{kind.__name__} ({__file__}:{line}) declares str and sends int"
    assert setup.sent[0] == b"good"


async def test_a_body_that_returns_nothing_to_send_is_told_with_its_line(kit: Any) -> None:
    class Forgets(DataChannelSendable[str]):
        def messages(self) -> Any:
            self.send("good")

    async with Setup(Forgets("it")) as setup:
        await kit.until(lambda: setup.failures)
    place = f"{__file__}:{Forgets.messages.__code__.co_firstlineno}"
    name = Forgets.messages.__qualname__
    assert str(setup.failures[0]) == f"{name}() ({place}) returned NoneType, and nothing to send. Let it yield."


async def test_a_picture_that_is_returned_is_told_once_and_no_row_of_it_is_shown(
    kit: Any, caplog: pytest.LogCaptureFixture
) -> None:
    class Returns(MediaTrackHandler):
        def frames(self) -> Any:
            return np.zeros((4, 6, 3), np.uint8)

    async with Setup(Returns("eye")) as setup:
        await kit.until(lambda: len(setup.failures) > 1)
    told = [record for record in caplog.records if "and no stream" in record.message]
    assert [record.levelname for record in told if record.levelname != "DEBUG"] == ["ERROR"]


async def test_a_def_body_keeps_its_thread_for_life(kit: Any) -> None:
    handler = Flaky()
    async with Setup(handler) as setup:
        await kit.until(lambda: setup.sent)
        setup.runner.want(False)
        count = handler.attempts
        setup.runner.want(True)
        await kit.until(lambda: handler.attempts > count)
    assert handler.threads == {"mosaic-flaky"}


@pytest.mark.parametrize("made", [Flaky, FlakyTask])
async def test_a_body_rests_while_nobody_wants_it(kit: Any, made: Callable[[], Any]) -> None:
    handler = made()
    handler.attempts = 2
    async with Setup(handler) as setup:
        await kit.until(lambda: setup.sent)
        setup.runner.want(False)
        await kit.until(lambda: setup.runner.state == "waiting")
        sent = len(setup.sent)
        await asyncio.sleep(0.05)
        assert len(setup.sent) == sent


class Twice(DataChannelSendable[str]):
    def messages(self) -> Iterator[str]:
        yield from ("a", "b")


class TwiceWatched(DataChannelSendable[str]):
    runs = "watched"

    async def messages(self) -> AsyncIterator[str]:
        yield "a"
        yield "b"


@pytest.mark.parametrize(("kind", "next_time"), [(Twice, "the robot starts"), (TwiceWatched, "somebody opens it")])
async def test_a_finished_body_has_ended_says_so_once_and_starts_again_when_wanted_anew(
    kit: Any, kind: Any, next_time: str, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO)
    async with Setup(kind("twice")) as setup:
        await kit.until(lambda: setup.runner.state == "ended")
        setup.runner.want(False)
        setup.runner.want(True)
        await kit.until(lambda: setup.sent == [b"a", b"b"] * 2)
    line = kind.messages.__code__.co_firstlineno
    told = f"connector 'twice': {kind.__name__}.messages ({__file__}:{line}) has ended without an error, "
    assert [one for one in caplog.messages if "has ended" in one] == [
        f"{told}and sends nothing more until {next_time} anew"
    ]


async def test_an_async_body_that_waits_for_its_device_is_cancelled_and_closed(kit: Any) -> None:
    class Waiting(FlakyTask):
        async def messages(self) -> AsyncIterator[str]:
            try:
                yield "a"
                await asyncio.Event().wait()
            finally:
                self.is_closed = True

    handler = Waiting()
    async with Setup(handler) as setup:
        await kit.until(lambda: setup.sent)
    assert handler.is_closed


class Leaving(Flaky):
    def messages(self) -> Iterator[str]:
        self.attempts += 1
        if self.attempts == 1:
            raise SystemExit(3)
        yield "here"


class LeavingTask(FlakyTask):
    async def messages(self) -> AsyncIterator[str]:
        self.attempts += 1
        if self.attempts == 1:
            raise SystemExit(3)
        yield "here"


class Interrupted(Flaky):
    def messages(self) -> Iterator[str]:
        self.attempts += 1
        if self.attempts == 1:
            raise KeyboardInterrupt
        yield "here"


class InterruptedTask(FlakyTask):
    async def messages(self) -> AsyncIterator[str]:
        self.attempts += 1
        if self.attempts == 1:
            raise KeyboardInterrupt
        yield "here"


@pytest.mark.parametrize("made", [Interrupted, InterruptedTask])
async def test_a_keyboard_interrupt_in_a_body_is_a_failure_like_any_other(kit: Any, made: Callable[[], Any]) -> None:
    async with Setup(made()) as setup:
        await kit.until(lambda: setup.sent == [b"here"])
        assert isinstance(setup.failures[0], KeyboardInterrupt)


class Bereft(FlakyTask):
    """Waits for something that is cancelled."""

    async def messages(self) -> AsyncIterator[str]:
        self.attempts += 1
        if self.attempts == 1:
            waited_for = asyncio.get_running_loop().create_future()
            waited_for.cancel()
            await waited_for
        yield "here"


async def test_a_body_whose_work_is_cancelled_by_somebody_else_fails_and_comes_back(kit: Any) -> None:
    async with Setup(Bereft()) as setup:
        await kit.until(lambda: setup.sent == [b"here"])
        assert isinstance(setup.failures[0], asyncio.CancelledError)


class Mule(DataChannelSendable[str]):
    """Swallows what cancels it, until it is let go."""

    def __init__(self) -> None:
        super().__init__("mule")
        self.let_go = asyncio.Event()

    async def messages(self) -> AsyncIterator[str]:
        yield "here"
        while not self.let_go.is_set():
            try:
                await self.let_go.wait()
            except asyncio.CancelledError:
                continue


async def test_a_body_that_swallows_its_cancellation_is_named_and_left_behind(
    kit: Any, caplog: pytest.LogCaptureFixture
) -> None:
    handler = Mule()
    async with Setup(handler) as setup:
        await kit.until(lambda: setup.sent)
        begun_s = time.monotonic()
        setup.runner.close()
        await setup.runner.closed()
    assert time.monotonic() - begun_s < STOP_PATIENCE_S + 1.0
    assert "connector 'mule' did not stop" in caplog.text
    assert not [task for task in asyncio.all_tasks() if "_outcome" in repr(task)], "asyncio.run would wait for it"
    handler.let_go.set()
    await asyncio.sleep(0.01)


class Waiting(DataChannelSendable[str]):
    async def messages(self) -> AsyncIterator[str]:
        self._settle()
        yield "here"

    def _settle(self) -> None:
        self.pause(0.1)


async def test_waiting_on_the_thread_of_the_event_loop_is_refused_with_the_line(kit: Any) -> None:
    async with Setup(Waiting("eager")) as setup:
        await kit.until(lambda: setup.failures)
        line = inspect.getsourcelines(Waiting._settle)[1] + 1
        assert f"test_runner.py:{line} in Waiting._settle" in str(setup.failures[0])
        assert setup.runner.state == "failed"


class Panic(BaseException):
    """What an extension in Rust raises."""


class PanickingTask(FlakyTask):
    async def messages(self) -> AsyncIterator[str]:
        self.attempts += 1
        if self.attempts == 1:
            raise Panic("index out of bounds")
        yield "here"


async def test_a_panic_in_an_async_body_is_a_failure_like_any_other(kit: Any) -> None:
    async with Setup(PanickingTask()) as setup:
        await kit.until(lambda: setup.sent == [b"here"])
        assert isinstance(setup.failures[0], Panic)


@pytest.mark.parametrize("made", [Leaving, LeavingTask])
async def test_sys_exit_in_a_body_is_a_failure_like_any_other(kit: Any, made: Callable[[], Any]) -> None:
    async with Setup(made()) as setup:
        await kit.until(lambda: setup.sent == [b"here"])
        assert isinstance(setup.failures[0], SystemExit)


def test_a_handler_that_only_pushes_has_no_body() -> None:
    class Pushing(DataChannelSendable[str]):
        pass

    assert body_of(Pushing("push")) is None
