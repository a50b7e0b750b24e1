"""The guard of the event loop names the connector and the line that block it, in the log and to whoever listens."""

from __future__ import annotations

import asyncio
import inspect
import time
from collections.abc import AsyncIterator

import pytest

from mosaic_core import DataChannelSendable
from mosaic_core.runtime.threads.loop_guard import LoopBlock, LoopGuard
from mosaic_core.testing import until

BLOCK_S = 0.6


class Sleepy(DataChannelSendable[str]):
    async def messages(self) -> AsyncIterator[str]:
        self._fetch()
        yield "late"

    def _fetch(self) -> None:
        time.sleep(BLOCK_S)


LINE = inspect.getsourcelines(Sleepy._fetch)[1] + 1


async def test_a_connector_that_sleeps_on_the_loop_is_named_with_its_line(caplog: pytest.LogCaptureFixture) -> None:
    sleepy, blocks = Sleepy("front"), list[LoopBlock]()
    guard = LoopGuard([sleepy], blocks.append)
    guard.start()
    await asyncio.sleep(0.3)
    await anext(aiter(sleepy.messages()))
    await until(lambda: any(block.label for block in blocks))
    guard.stop()
    [block] = [one for one in blocks if one.label]
    assert block.label == "front"
    assert block.place == f"{__file__}:{LINE} in Sleepy._fetch"
    assert block.duration_s > BLOCK_S / 2
    [record] = [record for record in caplog.records if getattr(record, "code", "") == "plugin.blocks_loop"]
    assert "by connector 'front'" in record.getMessage()
    assert block.place in record.getMessage()


async def test_a_loop_that_is_free_costs_nobody_a_word(caplog: pytest.LogCaptureFixture) -> None:
    blocks: list[LoopBlock] = []
    guard = LoopGuard([Sleepy("front")], blocks.append)
    guard.start()
    await asyncio.sleep(0.5)
    guard.stop()
    assert [block for block in blocks if block.label] == []
    assert "plugin.blocks_loop" not in caplog.text


async def sleep_in_a_task_of_ones_own() -> None:
    time.sleep(BLOCK_S)  # noqa: ASYNC251 - what is told


TASK_LINE = inspect.getsourcelines(sleep_in_a_task_of_ones_own)[1] + 1


@pytest.mark.parametrize(("labels", "label"), [(("front",), "front"), (("front", "rear"), "")])
async def test_a_task_of_a_connector_is_named_where_its_code_is_that_of_one(
    labels: tuple[str, ...], label: str, caplog: pytest.LogCaptureFixture
) -> None:
    blocks: list[LoopBlock] = []
    guard = LoopGuard([Sleepy(one) for one in labels], blocks.append)
    guard.start()
    await asyncio.sleep(0.3)
    await asyncio.create_task(sleep_in_a_task_of_ones_own())
    place = f"{__file__}:{TASK_LINE} in sleep_in_a_task_of_ones_own"
    await until(lambda: any(block.place == place for block in blocks))
    guard.stop()
    assert {block.label for block in blocks if block.place == place} == {label}
    assert ("plugin.blocks_loop" in caplog.text) == bool(label)
