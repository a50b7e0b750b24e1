"""Channels that only original dashboards know wake the connector's body, and no operator of ours is told of them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from mosaic_core import DataChannelSendable
from mosaic_core.machines.delivery.framing import PayloadKind
from mosaic_core.runtime.configuration.catalogue_entry import catalogue_entries
from mosaic_core.runtime.configuration.connector import Connector
from mosaic_core.words.data_type import Delivery


class CloudChannel(DataChannelSendable[bytes]):
    is_for_originals = True


class Cloud(DataChannelSendable[bytes]):
    """Sends each form only where somebody hears it."""

    runs = "watched"
    runs_now = 0

    def __init__(self, label: str, channel: CloudChannel) -> None:
        super().__init__(label)
        self.channel = channel
        self.rounds = 0

    def messages(self) -> Iterator[bytes]:
        self.runs_now += 1
        self.rounds += 1
        try:
            for _ in self.every(0.01):
                if self.channel.is_heard:
                    self.channel.send_burst([b"meta", b"one", b"two"])
                if self.is_heard:
                    yield b"compact"
        finally:
            self.runs_now -= 1


def cloud_of(kit: Any) -> tuple[Cloud, Connector]:
    channel = CloudChannel("cloud-0")
    cloud = Cloud("cloud", channel)
    return cloud, kit.connector_of(cloud, channel)


async def test_an_original_dashboard_wakes_the_body_and_gets_its_burst_in_order(kit: Any) -> None:
    cloud, connector = cloud_of(kit)

    async with kit.running(connector) as scene:
        operator = await scene.offered()
        assert cloud.runs_now == 0
        channel = operator.open("cloud-0", "")
        await kit.until(lambda: len(channel.sent) >= 6)
        assert channel.sent[:6] == [b"meta", b"one", b"two"] * 2
        channel.close()
        await kit.until(lambda: cloud.runs_now == 0)


async def test_one_body_serves_both_and_rests_when_the_last_has_gone(kit: Any) -> None:
    cloud, connector = cloud_of(kit)

    async with kit.running(connector) as scene:
        operator = await scene.offered()
        channel = operator.open("cloud-0", "")
        await kit.until(lambda: channel.sent)
        own = operator.open("cloud")
        await kit.until(lambda: own.frames())
        assert own.frames()[0].payload == b"compact"
        channel.close()
        count = len(own.frames())
        await kit.until(lambda: len(own.frames()) > count + 2)
        own.close()
        await kit.until(lambda: cloud.runs_now == 0)
        assert cloud.rounds == 1


async def test_a_burst_on_a_framed_channel_is_one_frame_per_part(kit: Any) -> None:
    _, connector = cloud_of(kit)

    async with kit.running(connector) as scene:
        operator, _ = await scene.greeted()
        channel = operator.open("cloud-0")
        await kit.until(lambda: len(channel.frames()) >= 3)
        frames = channel.frames()[:3]
        assert [frame.payload for frame in frames] == [b"meta", b"one", b"two"]
        assert [frame.seq for frame in frames] == [1, 2, 3]
        assert {frame.kind for frame in frames} == {PayloadKind.BYTES}


def test_the_catalogue_tells_of_the_own_channel_alone(kit: Any) -> None:
    cloud, connector = cloud_of(kit)
    (entry,) = catalogue_entries("cloud", "point-cloud", connector.handlers)
    assert [channel.label for channel in entry.channels] == ["cloud"]
    assert cloud.channel.data_type is entry.data_type


class Still(DataChannelSendable[bytes]):
    """Has nothing to do with the cloud beside it."""

    runs = "watched"
    delivery = Delivery.LATEST
    runs_now = 0

    def messages(self) -> Iterator[bytes]:
        self.runs_now += 1
        try:
            for _ in self.every(0.01):
                yield b"still"
        finally:
            self.runs_now -= 1


async def test_a_channel_for_originals_repeats_the_handler_before_it_wherever_that_stands(kit: Any) -> None:
    still, channel = Still("picture"), CloudChannel("cloud-0")
    cloud = Cloud("cloud", channel)
    connector = kit.connector_of(still, cloud, channel, Still("intrinsics"), label="depth")
    assert [[one.label for one in group.handlers] for group in connector.groups] == [
        ["picture"], ["cloud", "cloud-0"], ["intrinsics"],
    ]  # fmt: skip
    assert connector.terms_of(channel) == connector.terms_of(cloud) != connector.terms_of(still)

    async with kit.running(connector) as scene:
        operator = await scene.offered()
        opened = operator.open("cloud-0", "")
        await kit.until(lambda: len(opened.sent) >= 3)
        assert (opened.sent[:3], cloud.runs_now, still.runs_now) == ([b"meta", b"one", b"two"], 1, 0)


def test_a_channel_for_originals_that_stands_first_repeats_the_first_handler(kit: Any) -> None:
    channel = CloudChannel("cloud-0")
    cloud = Cloud("cloud", channel)
    (group,) = kit.connector_of(channel, cloud, label="cloud").groups
    assert group.handlers == (cloud, channel)


class Scan(DataChannelSendable[bytes]):
    """Bytes for ours, text for original dashboards, on one channel."""

    delivery = Delivery.LATEST
    texts = 0

    def messages(self) -> Iterator[bytes]:
        for _ in self.every(0.01):
            self.send_bytes(b"compact", original_text=self._text)
        yield from ()

    def _text(self) -> str:
        self.texts += 1
        return '{"ranges": []}'


async def test_original_dashboards_get_the_text_that_they_know_and_it_is_made_for_them_alone(kit: Any) -> None:
    scan = Scan("scan")

    async with kit.running(kit.connector_of(scan)) as scene:
        operator, _ = await scene.greeted()
        own = operator.open("scan")
        await kit.until(lambda: len(own.frames()) > 2)
        assert scan.texts == 0
        assert own.frames()[-1].payload == b"compact"
        own.close()
        original = operator.open("scan", "")
        await kit.until(lambda: len(original.sent) > 2)
        assert set(original.sent) == {'{"ranges": []}'}
