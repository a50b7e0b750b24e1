"""Messages whose schema id a robot announces are read as what they are."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

import pytest

from mosaic_core import DataChannelBidirectional, DataChannelConfigurer, DataChannelSendable, Message, NoParams
from mosaic_core.messages import BatteryState, Twist
from mosaic_core.operator import MessageInfo, Received
from mosaic_core.testing import connector, joined
from mosaic_core.words.errors import WireError


class Pack(BatteryState):
    cells: int = 6


class Gauge(DataChannelSendable[Pack]):
    def messages(self) -> Iterator[Pack]:
        for _ in self.every(0.02):
            yield Pack(percent=50.0)


class GaugeConfigurer(DataChannelConfigurer[NoParams]):
    connector_type = "gauge"

    def configure(self) -> Gauge:
        return Gauge(self.label)


class Words(Message):
    text: str = "hello"


class Talker(DataChannelSendable[Words]):
    def messages(self) -> Iterator[Words]:
        for _ in self.every(0.02):
            yield Words()


class TalkerConfigurer(DataChannelConfigurer[NoParams]):
    connector_type = "talker"

    def configure(self) -> Talker:
        return Talker(self.label)


class Base(DataChannelBidirectional[Twist]):
    def handle_data(self, data: Twist, sender: Any) -> None:
        self.send_json({"heard": data.linear.x}, to=sender)


class BaseConfigurer(DataChannelConfigurer[NoParams]):
    connector_type = "base"

    def configure(self) -> Base:
        return Base(self.label)


async def test_a_standard_message_is_read_as_one_and_an_own_one_is_not() -> None:
    async with joined(connector(GaugeConfigurer, label="pack"), connector(TalkerConfigurer, label="talk")) as link:
        pack = await link.connection.receivable("pack").next_message()
        assert pack.message() == BatteryState(percent=50.0)
        assert pack.info.schema_id == "mosaic/BatteryState@1"
        assert (await link.connection.receivable("talk").next_message()).message() is None


async def test_the_id_of_a_channel_both_ways_is_that_of_what_the_robot_takes() -> None:
    async with joined(connector(BaseConfigurer, label="base")) as link:
        assert link.connection.catalogue is not None
        entry = link.connection.catalogue.entries[0]
        assert entry.schema_id == "mosaic/Twist@1"
        store = link.connection.bidirectional("base")
        await store.wait_open()
        store.send_json(Twist.planar(0.5))
        answer = await store.next_message()
        assert answer.json() == {"heard": 0.5}
        assert answer.message() is None


def received(message: object, schema_id: str) -> Received:
    return Received(json.dumps(message).encode(), MessageInfo(0.0, schema_id=schema_id))


def test_what_is_none_of_what_was_announced_says_which_field_is_wrong() -> None:
    with pytest.raises(WireError, match=r"mosaic/BatteryState@1: percent .*number"):
        received({"percent": "full"}, "mosaic/BatteryState@1").message()


def test_an_id_that_nobody_knows_here_is_no_mistake() -> None:
    assert received({"percent": "full"}, "mosaic/BatteryState@99").message() is None
