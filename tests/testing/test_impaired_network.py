"""Bad networks in memory, and the fixture that plugin authors use."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Iterator
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mosaic_core import DataChannelConfigurer, DataChannelJsonReceivable, DataChannelSendable, Message, NoParams
from mosaic_core.laboratory.impairment import Impairment
from mosaic_core.laboratory.memory_impairment import LatePictures, MessageFlow
from mosaic_core.testing import LinkProfile, connector, joined, until
from mosaic_core.words.data_type import Delivery


class Count(Message):
    number: int


class Counting(DataChannelSendable[Count]):
    delivery = Delivery.RELIABLE

    def messages(self) -> Iterator[Count]:
        for number, _ in enumerate(self.every(0.02)):
            yield Count(number=number)


class CountingConfigurer(DataChannelConfigurer[NoParams]):
    connector_type = "counting"

    def configure(self) -> Counting:
        return Counting(self.label)


class Noting(DataChannelJsonReceivable):
    delivery = Delivery.LATEST

    def __init__(self, label: str) -> None:
        super().__init__(label)
        self.heard: list[Any] = []

    def handle_data(self, data: dict[str, Any]) -> None:
        self.heard.append(data)


class NotingConfigurer(DataChannelConfigurer[NoParams]):
    connector_type = "noting"

    def configure(self) -> Noting:
        return Noting(self.label)


async def numbers(link: Any, count: int) -> list[int]:
    found: list[int] = []
    async with asyncio.timeout(30):
        async for message in link.connection.receivable("under_test").messages():
            found.append(message.json()["number"])
            if len(found) == count:
                return found
    raise AssertionError


@pytest.mark.parametrize("in_memory", [True, pytest.param(False, marks=pytest.mark.webrtc)])
async def test_a_reliable_connector_loses_nothing_on_a_bad_network(impaired_network: Any, in_memory: bool) -> None:
    network = impaired_network(LinkProfile("bad", delay_ms=10, loss=0.2), in_memory=in_memory)
    async with joined(connector(CountingConfigurer), network=network) as link:
        found = await numbers(link, 30)
        assert found == list(range(found[0], found[0] + 30))


async def test_commands_of_the_kind_latest_may_be_lost_but_arrive_when_the_network_is_well_again(
    impaired_network: Any,
) -> None:
    async with joined(connector(NotingConfigurer), network=impaired_network(in_memory=True)) as link:
        noting = link.configured.connectors[0].handlers[0]
        assert isinstance(noting, Noting)
        pad = link.connection.sendable("under_test")
        await pad.wait_open()
        link.network.become(LinkProfile("dead", loss=1.0))
        assert pad.send_json({"n": 1})
        link.network.become("pristine")
        assert pad.send_json({"n": 2})
        await until(lambda: noting.heard == [{"n": 2}])


async def test_a_cable_that_is_back_in_time_ends_nothing(impaired_network: Any) -> None:
    async with joined(connector(CountingConfigurer), network=impaired_network(in_memory=True)) as link:
        before = (await numbers(link, 1))[0]
        link.cut()
        await asyncio.sleep(0.3)
        link.network.heal()
        found = await numbers(link, 30)
        assert found == list(range(found[0], found[0] + 30))
        assert found[0] > before
        assert link.connection.state == "connected"


def test_there_is_no_nat_in_memory(impaired_network: Any) -> None:
    with pytest.raises(ValueError, match="no NAT in memory"):
        impaired_network(in_memory=True, nat="symmetric")


# -- what it is made of ------------------------------------------------------------------------------------------------


@settings(max_examples=25, deadline=None)
@given(
    losses=st.floats(0, 0.6),
    delay=st.floats(0, 5),
    seed=st.integers(0, 99),
    count=st.integers(1, 40),
    cut=st.booleans(),
)
def test_a_reliable_flow_delivers_everything_once_and_in_order(
    losses: float, delay: float, seed: int, count: int, cut: bool
) -> None:
    async def run() -> list[Any]:
        impairment = Impairment(LinkProfile("x", delay_ms=delay, loss=losses), seed=seed)
        is_cut, came = [False], list[Any]()
        flow = MessageFlow(impairment, impairment.up, lambda: is_cut[0], came.append, is_reliable=True)
        for number in range(count):
            is_cut[0] = cut and number % 3 == 1
            flow.take(str(number))
            await asyncio.sleep(0)
        is_cut[0] = False
        impairment.become("pristine")
        await until(lambda: len(came) >= count)
        flow.close()
        return came

    assert asyncio.run(run()) == [str(number) for number in range(count)]


async def test_an_unreliable_flow_loses_its_share_and_is_late() -> None:
    impairment = Impairment(LinkProfile("x", delay_ms=30, loss=0.3))
    came: list[float] = []
    start_s = time.monotonic()
    flow = MessageFlow(
        impairment, impairment.up, lambda: False, lambda _: came.append(time.monotonic() - start_s), is_reliable=False
    )
    for _ in range(200):
        flow.take(b"x")
    await until(lambda: len(came) == 200 - impairment.up.lost)
    assert 100 < len(came) < 180
    assert min(came) >= 0.029


async def test_pictures_are_late_but_not_fewer() -> None:
    impairment = Impairment(LinkProfile("x", delay_ms=100))
    sent = iter(range(1000))

    async def following() -> int:
        await asyncio.sleep(0.01)
        return next(sent)

    late = LatePictures(impairment, lambda: False, following)
    start_s = time.monotonic()
    assert [await late.next() for _ in range(20)] == list(range(20))
    took_s = time.monotonic() - start_s
    late.stop()
    assert 0.25 < took_s < 1.5
