"""Operators that ask learn how the data travels; nobody else does."""

from __future__ import annotations

import asyncio
import time
from dataclasses import replace
from typing import Any, get_args

import pytest

from mosaic_core import DataChannelJsonReceivable, DataChannelSendable
from mosaic_core.contract.host import Loss
from mosaic_core.machines.delivery.send_scheduler import HIGH_WATER_BYTES, LOW_WATER_BYTES
from mosaic_core.runtime.observation import delivery_reports
from mosaic_core.runtime.observation.counters import ConnectorSnapshot
from mosaic_core.runtime.observation.delivery_reports import DeliveryReports, row_of
from mosaic_core.words.control import ControlMessage, DeliveryReport, DeliveryWatch
from mosaic_core.words.data_type import Delivery


class Pose(DataChannelSendable[dict[str, Any]]):
    delivery = Delivery.LATEST


class Events(DataChannelSendable[dict[str, Any]]):
    delivery = Delivery.BULK


class Reader:
    def __init__(self) -> None:
        self.reports: list[DeliveryReport] = []

    def answer(self, message: ControlMessage) -> None:
        assert isinstance(message, DeliveryReport)
        self.reports.append(message)


def snapshot() -> tuple[ConnectorSnapshot, ...]:
    counts = dict.fromkeys(("messages", "size_bytes", "queue_messages", "queue_bytes", "replaced", "dropped"), 1)
    more = dict.fromkeys(("too_large", "thinned", "refused", "lost", "resent", "failures", "peers"), 2)
    words = {"label": "pose", "type": "t", "kind": "data", "direction": "to-operator", "state": "running"}
    return (
        ConnectorSnapshot(
            **words, **counts, **more, delivery="latest", rate_hz=9.876, bytes_per_s=1.0, last_error="", age_s=0.25
        ),
    )


@pytest.fixture
def reports(monkeypatch: pytest.MonkeyPatch) -> DeliveryReports:
    monkeypatch.setattr(delivery_reports, "DELIVERY_REPORT_PERIOD_S", 0.05)
    return DeliveryReports(snapshot)


async def test_reports_come_at_once_then_periodically_until_nobody_asks(kit: Any, reports: DeliveryReports) -> None:
    ann, bob = Reader(), Reader()
    for _ in range(2):
        reports.watch(ann, True)
    await kit.until(lambda: len(ann.reports) >= 2)
    reports.watch(bob, True)
    await kit.until(lambda: len(bob.reports) >= 2)
    reports.watch(ann, False)
    reports.watch(bob, False)
    reports.watch(bob, False)
    told = len(ann.reports), len(bob.reports)
    await asyncio.sleep(0.15)
    assert (len(ann.reports), len(bob.reports)) == told
    (row,) = ann.reports[0].connectors
    assert (row.label, row.delivery, row.rate_hz, row.age_ms) == ("pose", "latest", 9.88, 250.0)
    assert (row.too_large, row.thinned) == (2, 2)
    assert (row.failure_code, row.tries_again_in_s) == (None, None)


async def test_asking_again_and_again_brings_no_more_reports(reports: DeliveryReports) -> None:
    ann, began_s = Reader(), time.monotonic()
    while len(ann.reports) < 3:
        reports.watch(ann, True)
        await asyncio.sleep(0.002)
        reports.watch(ann, False)
    assert time.monotonic() - began_s > 0.09


async def test_of_a_burst_that_overflows_its_queue_as_many_count_as_sent_as_arrive(kit: Any) -> None:
    events = Events("events")
    async with kit.running(kit.connector_of(events)) as scene:
        ann = await scene.enters("ann")
        channel = ann.open("events")
        await kit.until(lambda: events.is_heard)
        ann.control.channel.buffered_bytes = HIGH_WATER_BYTES
        for number in range(600):
            events.send_json({"number": number})

        def counted() -> tuple[int, int]:
            (row,) = scene.robot.snapshot().connectors
            return row.messages, row.dropped

        await kit.until(lambda: sum(counted()) == 600)
        ann.control.channel.buffered_bytes = 0
        channel.on_drained()
        await kit.until(lambda: len(channel.values()) == 64)
        assert counted() == (64, 536)


async def test_a_value_of_before_counts_as_sent_once_somebody_comes_for_it(kit: Any) -> None:
    pose = Pose("pose")
    async with kit.running(kit.connector_of(pose)) as scene:
        await kit.until(lambda: scene.robot.snapshot().connectors)
        assert pose.send_json({"x": 1}) is False
        for name in ("ann", "bob"):
            assert scene.robot.snapshot().connectors[0].messages == (name == "bob")
            channel = (await scene.enters(name)).open("pose")
            await kit.until(lambda channel=channel: channel.values(latched=True) == [{"x": 1}])
        (row,) = scene.robot.snapshot().connectors
        assert (row.messages, row.dropped) == (1, 0)


async def test_what_a_handler_itself_leaves_out_is_told_with_the_rest(kit: Any) -> None:
    pose = Pose("pose")
    async with kit.running(kit.connector_of(pose)) as scene:
        await kit.until(lambda: scene.robot.snapshot().connectors)
        reasons: tuple[Loss, ...] = get_args(Loss)
        for number, reason in enumerate(reasons, 1):
            await asyncio.to_thread(pose.count_loss, reason, number)
        pose.count_loss("refused")
        (shown,) = scene.robot.snapshot().connectors
        row = row_of(shown)
        told = {reason: getattr(row, reason) for reason in reasons}
        assert told == {"replaced": 1, "dropped": 2, "too_large": 3, "thinned": 4, "refused": 6, "lost": 6}
        assert row.messages == 0


def test_before_the_robot_runs_nobody_counts() -> None:
    Pose("pose").count_loss("lost")


async def test_an_operator_that_asks_learns_of_values_that_were_replaced(kit: Any) -> None:
    pose, sink = Pose("pose"), DataChannelJsonReceivable("sink")
    async with kit.running(kit.connector_of(pose), kit.connector_of(sink)) as scene:
        ann = await scene.enters("ann")
        channel = ann.open("pose")
        ann.control.channel.buffered_bytes = LOW_WATER_BYTES  # SCTP has one buffer, which any channel knows
        await kit.until(lambda: pose.send_json({"x": 0}))
        for x in range(3):
            pose.send_json({"x": x})
        await kit.until(lambda: scene.robot.snapshot().connectors[0].messages == 4)
        ann.say(DeliveryWatch(on=True))
        report = await ann.hears("delivery.report")
        rows = {row.label: row for row in report.connectors}
        assert (rows["pose"].messages, rows["pose"].replaced, rows["pose"].queue_messages) == (4, 3, 1)
        assert rows["sink"].delivery == "reliable"
        ann.control.channel.buffered_bytes = 0
        channel.on_drained()
        await kit.until(lambda: channel.values() == [{"x": 2}])


def test_of_a_failure_operators_learn_its_code_and_the_next_try_and_no_word_of_the_plugins() -> None:
    (well,) = snapshot()
    failing = replace(
        well, state="failed", last_error="/dev/secret", failure_code="plugin.no_device", tries_again_in_s=8.04
    )
    row = row_of(failing)
    assert (row.failure_code, row.tries_again_in_s) == ("plugin.no_device", 8.0)
    assert "secret" not in row.model_dump_json()
