"""How old a value is: known as soon as the clocks are, also of one that came before they were."""

from __future__ import annotations

import asyncio
import time

from mosaic_core.contract.configurer import DataChannelConfigurer
from mosaic_core.contract.handler import DataChannelSendable
from mosaic_core.contract.params import Params
from mosaic_core.laboratory.joining import connector, joined, until
from mosaic_core.operator.delivery.data_port import MessageInfo
from mosaic_core.operator.stores.robot_connector import RobotConnector
from mosaic_core.operator.stores.stores import ReceivableStore


class Battery(DataChannelSendable[dict[str, int]]):
    def __init__(self, label: str) -> None:
        super().__init__(label)


class BatteryConfigurer(DataChannelConfigurer[Params]):
    def configure(self) -> Battery:
        return Battery(self.label)


def test_a_value_that_came_before_the_clocks_were_known_gets_its_age_when_they_are() -> None:
    store, known = ReceivableStore(RobotConnector("robot", "battery")), dict[int, int]()
    now_s = time.monotonic()
    store.notify_subscribers(b"1", MessageInfo(now_s, 1, 77, True, known.get))
    assert store.latest is not None
    assert store.latest.info.age_s is None
    known[77] = round((now_s - 3600) * 1e6)
    assert abs(store.latest.info.age_s - 3600) < 0.001
    assert store.latest_age_s is not None
    assert store.latest_age_s >= 3599.9


def test_without_a_stamp_nobody_knows_and_an_age_is_never_negative() -> None:
    assert MessageInfo(5.0, to_ours_us=lambda _: 1_000_000).age_s is None
    assert MessageInfo(5.0, stamp_us=1, to_ours_us=lambda _: 6_000_000).age_s == 0.0


async def test_a_latched_value_tells_how_long_ago_it_was_made_before_anything_newer_comes() -> None:
    async with asyncio.timeout(20), joined(connector(BatteryConfigurer, label="battery")) as link:
        (battery,) = (one.handlers[0] for one in link.configured.connectors)
        made_s = time.monotonic()
        battery.send_json({"percent": 7})
        late = await link.another_operator("Ann")
        store = late.receivable("battery")
        message = await store.next_message()
        assert message.info.is_latched
        await until(lambda: message.info.age_s is not None)
        assert store.latest_age_s is not None
        assert store.latest_age_s >= time.monotonic() - made_s - 0.1
