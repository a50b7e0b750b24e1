"""Answers of the built-in check toward an original operator: each is delivered, or counted as lost."""

from __future__ import annotations

from typing import Any

from mosaic_core.contract.params import NoParams
from mosaic_core.machines.delivery.send_scheduler import HIGH_WATER_BYTES, LIMITS, Priority
from mosaic_core.runtime.handlers.connection_check import ConnectionCheckConfigurer

BURST = 2000
MOST_WAITING = LIMITS[Priority.RELIABLE].messages


def check_of(kit: Any) -> Any:
    handlers = ConnectionCheckConfigurer("link", NoParams()).configure()
    return kit.connector_of(*handlers, label="link")


async def test_a_burst_that_outruns_the_link_is_delivered_in_order_or_counted_and_never_piles_up(kit: Any) -> None:
    async with kit.running(check_of(kit)) as scene:
        end = await scene.connects("old")
        answers, asks = end.open("link-sender", ""), end.open("link-receiver", "")
        answers.buffered_bytes = HIGH_WATER_BYTES  # the link stands still
        for number in range(BURST):
            asks.say(str(number))

        def row() -> Any:
            return scene.robot.snapshot().connectors[0]

        await kit.until(lambda: row().queue_messages + row().dropped + row().refused == BURST)
        assert row().queue_messages <= MOST_WAITING
        answers.buffered_bytes = 0
        answers.on_drained()
        await kit.until(lambda: row().queue_messages == 0)
        numbers = [int(text) for text in answers.sent]
        assert numbers == sorted(set(numbers))
        assert len(numbers) + row().dropped + row().refused == BURST


async def test_answers_that_nobody_takes_are_counted_as_lost(kit: Any) -> None:
    async with kit.running(check_of(kit)) as scene:
        asks = (await scene.connects("old")).open("link-receiver", "")
        for number in range(10):
            asks.say(str(number))
        await kit.until(lambda: scene.robot.snapshot().connectors[0].lost == 10)
        assert scene.robot.snapshot().connectors[0].messages == 10, "what came; nothing has left"
