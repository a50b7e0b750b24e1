"""The child that serves a robot's own network: its news and log are passed on, it comes back when it dies, it ends."""

from __future__ import annotations

import asyncio
import logging
import os
import signal
import sys
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import pytest

from mosaic_core.laboratory.joining import until
from mosaic_core.machines.timing.backoff import BackoffPolicy
from mosaic_core.runtime.lan import lan_twin
from mosaic_core.runtime.lan.lan_twin import LanTwin
from mosaic_core.words.config import AuthConfig, ServerConfig
from mosaic_core.words.errors import SignalingError
from mosaic_core.words.lan import LanChild, LanNews

NEWS = LanNews(urls=("http://10.0.0.7:9002",), devices=1).model_dump_json(by_alias=True)
SERVES = f"import sys; print({NEWS!r}, flush=True); "
UNTIL_THE_ROBOT_ENDS = "sys.stdin.read()"


class Twin:
    """A twin around a small program, and what it told."""

    def __init__(self, program: str) -> None:
        auth = AuthConfig.model_validate({"type": "no-authorization", "robot_id": "0" * 32})
        child = LanChild((sys.executable, "-c", program), ServerConfig(ws_url="ws://127.0.0.1:9", auth=auth))
        self.news: list[LanNews] = []
        self.opened: list[str] = []
        self.twin = LanTwin(child, self.open, self.news.append)
        self.running = asyncio.create_task(self.twin.run())

    async def open(self, url: str) -> object:
        self.opened.append(url)
        return object()

    async def end(self) -> None:
        self.twin.begin_end()
        await asyncio.to_thread(self.twin.end, time.monotonic() + 3)
        await asyncio.wait_for(self.running, 30)


@asynccontextmanager
async def play(program: str) -> AsyncIterator[Any]:
    async with asyncio.timeout(30):
        twin = Twin(program)
        try:
            yield twin
        finally:
            await twin.end()


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lan_twin, "_POLICY", BackoffPolicy(first_s=0.01, max_s=0.02))


async def test_its_news_are_told_and_the_robot_connects_once_it_listens() -> None:
    async with play(SERVES + UNTIL_THE_ROBOT_ENDS) as twin:
        connecting = asyncio.create_task(twin.twin.connect("ws://127.0.0.1:9/ws/robot"))
        await connecting
        assert [one.devices for one in twin.news] == [1]
        assert twin.opened == ["ws://127.0.0.1:9/ws/robot"]


async def test_before_it_listens_the_robot_waits_and_its_end_does_not() -> None:
    async with play("import sys; " + UNTIL_THE_ROBOT_ENDS) as twin:
        connecting = asyncio.create_task(twin.twin.connect("ws://127.0.0.1:9/ws/robot"))
        await until(lambda: twin.twin.pid)
        assert not connecting.done()
        twin.twin.begin_end()
        with pytest.raises(SignalingError, match="stops"):
            await connecting
        assert twin.opened == []


@pytest.mark.usefixtures("quick")
async def test_killed_it_comes_back_and_the_robot_can_connect_again(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.INFO):
        async with play(SERVES + UNTIL_THE_ROBOT_ENDS) as twin:
            await until(lambda: len(twin.news) == 1)
            assert twin.twin.pid is not None
            os.kill(twin.twin.pid, signal.SIGKILL)
            await until(lambda: len(twin.news) == 2)
            await twin.twin.connect("ws://127.0.0.1:9/ws/robot")
    assert caplog.text.count("lan server: it ended with exit code -9; it starts again in") == 1
    assert caplog.text.count("lan server: it is there again") == 1


@pytest.mark.usefixtures("quick")
async def test_one_that_never_starts_is_tried_again_and_its_last_words_are_told(
    caplog: pytest.LogCaptureFixture,
) -> None:
    async with play("raise SystemExit('the disk is full')"):
        await until(lambda: caplog.text.count("exit code 1") >= 3)
    assert "lan server: the disk is full" in caplog.text


async def test_a_program_that_is_not_there_is_told(
    caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "executable", "/nowhere/python")

    async with play(""):
        await until(lambda: "can't be started" in caplog.text)


LOG = r"""
import sys, json
print(json.dumps({"level": "warning", "message": "a PIN was wrong", "code": "auth.pairing"}), file=sys.stderr)
print(json.dumps({"level": "error", "message": "broken", "exception": "Traceback"}), file=sys.stderr)
print("plain words", file=sys.stderr)
print("", file=sys.stderr)
print("x" * 100_000, file=sys.stderr, flush=True)
print("no news", flush=True)
"""


async def test_its_log_lines_become_ours_with_their_levels(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.INFO):
        async with play(LOG + SERVES + UNTIL_THE_ROBOT_ENDS) as twin:
            await until(lambda: twin.news)
    told = {(one.levelname, one.getMessage()) for one in caplog.records}
    assert ("WARNING", "lan server: a PIN was wrong") in told
    assert ("ERROR", "lan server: broken\nTraceback") in told
    assert ("ERROR", "lan server: plain words") in told
    assert ("WARNING", "lan server: said something unreadable") in told
    assert any(getattr(one, "code", "") == "auth.pairing" for one in caplog.records)


async def test_one_that_is_deaf_is_killed_in_time() -> None:
    deaf = "import signal, time; signal.signal(signal.SIGTERM, signal.SIG_IGN); " + SERVES + "time.sleep(60)"

    async with play(deaf) as twin:
        await until(lambda: twin.news)
        began_s = time.monotonic()
        await asyncio.to_thread(twin.twin.end, began_s + 0.3)
        assert time.monotonic() - began_s < 2.0


async def test_it_hears_of_the_robots_sudden_death_by_its_standard_input(tmp_path: Path) -> None:
    gone = tmp_path / "gone"
    program = SERVES + f"{UNTIL_THE_ROBOT_ENDS}; open({str(gone)!r}, 'w').close()"

    async with play(program) as twin:
        await until(lambda: twin.news)
        process = twin.twin._process
        assert process is not None
        assert process.process.stdin is not None
        twin.twin.begin_end()
        process.process.stdin.close()
        await until(gone.exists)
