"""A trial run waits for the connector that it is about."""

from __future__ import annotations

from collections.abc import Iterator

from mosaic_core import DataChannelConfigurer, DataChannelSendable, Message, NoParams
from mosaic_core.laboratory.joining import configured_with, connector
from mosaic_core.ladder.stand_ins import StandInChannelConfigurer
from mosaic_core.ladder.trial_run import entered, trial_run


class Tick(Message):
    number: int


class Late(DataChannelSendable[Tick]):
    def messages(self) -> Iterator[Tick]:
        self.pause(0.3)
        raise ValueError("late")
        yield Tick(number=1)


class LateConfigurer(DataChannelConfigurer[NoParams]):
    connector_type = "late"

    def configure(self) -> Late:
        return Late(self.label)


async def test_what_stands_beside_a_connector_is_not_taken_for_its_beginning() -> None:
    both = [connector(LateConfigurer, label="late"), connector(StandInChannelConfigurer, label="pose")]
    configured = configured_with(both)
    async with entered(configured), trial_run(configured) as run:
        await run.begun(20.0)
        assert [str(error) for error in run.failures] == ["late"]
