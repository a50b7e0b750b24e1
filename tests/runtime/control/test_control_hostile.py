"""Hostile control messages: they never crash the robot, never move it, and are answered."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from support.connectors import Motor

from mosaic_core.words import control
from mosaic_core.words.control import CONTROL_MESSAGES

JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=20),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=8), inner, max_size=4),
    max_leaves=12,
)
LEASES = ("lease.request", "lease.keep", "lease.release", "lease.answer", "stop.clear", "journal.read", "media.seen")
FIELDS = ("resource", "reason", "force", "epochs", "peerId", "grant", "message", "id", "label", "captureUs", "limit")
HOSTILE = st.builds(
    lambda kind, data: json.dumps({"type": kind, "data": data}),
    st.sampled_from(sorted({*CONTROL_MESSAGES, "nonsense"} - {"bye", "stop"})),
    JSON | st.dictionaries(st.sampled_from(FIELDS), JSON, max_size=5),
)


@asynccontextmanager
async def played(kit: Any) -> AsyncIterator[Any]:
    motor = Motor(requires_lease=True)
    async with kit.running(kit.connector_of(motor)) as scene:
        yield scene, motor


@settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(messages=st.lists(HOSTILE, max_size=12), bits=st.lists(st.binary(max_size=60), max_size=4))
async def test_whatever_an_observer_says_nothing_moves_and_others_go_on(
    kit: Any, messages: list[str], bits: list[bytes]
) -> None:
    async with played(kit) as (scene, motor):
        eve, ann = await scene.enters("eve", role="observer"), await scene.enters("ann")
        drive, epoch = ann.open("drive"), await ann.take()
        theft = eve.open("drive")
        for text in messages:
            eve.control.channel.say(text)
            eve.stops.channel.say(text)
            theft.say({"v": "theft"}, epoch=epoch)
        for piece in bits:
            for channel in (eve.control.channel, eve.stops.channel, theft):
                assert channel.on_message is not None
                channel.on_message(piece)
        drive.say({"v": 1}, epoch=epoch)
        await kit.until(lambda: motor.log)
        assert motor.log == [1]
        assert ann.heard("lease.state")[-1].holder.name == "ann"
        assert eve.codes("refusal") or not messages
        eve.control.channel.say(control.Ping(t0=1).to_text())
        assert (await eve.hears("pong")).t0 == 1


@pytest.mark.parametrize("kind", LEASES)
async def test_a_malformed_request_is_answered_with_what_is_wrong(kit: Any, kind: str) -> None:
    async with played(kit) as (scene, _motor):
        eve = await scene.enters("eve")
        broken = {"resource": 7, "epochs": [], "peerId": {}, "limit": "all", "label": 1, "captureUs": "now"}
        eve.control.channel.say({"type": kind, "data": broken})
        eve.control.channel.say({"type": kind, "data": "all of it"})
        if kind != "stop.clear":  # has no field that could be wrong
            refusal = await eve.hears("refusal")
            assert refusal.label == control.CONTROL_LABEL
            assert kind in refusal.message


async def test_somebody_who_asks_without_end_is_told_so_and_delays_nobody(kit: Any) -> None:
    async with played(kit) as (scene, _motor):
        eve, ann = await scene.enters("eve"), await scene.enters("ann")
        for _ in range(500):
            eve.say(control.LeaseRequest())
            eve.say(control.LeaseRelease())
        assert len(eve.heard("lease.reply")) < 100
        assert "signal.too_slow" in eve.codes()
        eve.leave()
        await kit.until(lambda: ann.heard("lease.state")[-1].holder is None)
        await ann.take()


async def test_nobody_forces_a_lease_without_being_a_supervisor_with_a_reason(kit: Any) -> None:
    async with played(kit) as (scene, _motor):
        ann, eve = await scene.enters("ann"), await scene.enters("eve")
        boss = await scene.enters("boss", role="supervisor")
        await ann.take()
        eve.say(control.LeaseRequest(force=True, reason="because"))
        boss.say(control.LeaseRequest(force=True, reason="  "))
        for who in (eve, boss):
            assert (await who.hears("lease.reply")).code == "lease.force_forbidden"
        eve.say(control.LeaseAnswer(peer_id=eve.peer_id, grant=True))
        eve.say(control.LeaseRequest(resource="nothing"))
        assert (await eve.hears("lease.reply", 2)).code == "lease.unknown_resource"
        assert ann.heard("lease.state")[-1].holder.name == "ann"


async def test_the_journal_is_read_by_supervisors_only(kit: Any) -> None:
    async with played(kit) as (scene, motor):
        ann, boss = await scene.enters("ann"), await scene.enters("boss", role="supervisor")
        drive, epoch = ann.open("drive"), await ann.take()
        drive.say({"v": 1}, epoch=epoch)
        await kit.until(lambda: motor.log)
        for _ in range(50):
            drive.say({"v": 2}, epoch=epoch + 1)
        ann.stop(reason="look out")
        await kit.until(lambda: "safety.stop" in motor.log)
        ann.say(control.JournalRead())
        await kit.until(lambda: "auth.forbidden" in ann.codes())
        boss.say(control.JournalRead(limit=50))
        entries = (await boss.hears("journal")).entries
        numbers = [entry.number for entry in entries]
        assert numbers == sorted(numbers, reverse=True)
        seen = [(entry.what, entry.who, entry.subject, entry.code) for entry in reversed(entries)]
        assert seen == [
            ("peer.connected", "ann", "", ""),
            ("peer.connected", "boss", "", ""),
            ("lease.granted", "ann", "motion", ""),
            ("command.accepted", "ann", "drive", ""),
            ("command.refused", "ann", "drive", "lease.old_epoch"),
            ("stop", "ann", "", ""),
        ]
        boss.say(control.JournalRead(limit=2, before=numbers[1]))
        assert [entry.number for entry in (await boss.hears("journal", 2)).entries] == numbers[2:4]


async def test_what_is_said_before_the_hello_is_answered_and_does_nothing(kit: Any) -> None:
    async with played(kit) as (scene, _motor):
        end = await scene.connects("rude")
        channel = end.open(control.CONTROL_LABEL)
        channel.say({"type": "lease.request", "data": {}})
        await kit.until(lambda: [value for value in channel.values() if value["type"] == "refusal"])
        await asyncio.sleep(0)
        assert scene.robot.snapshot().leases[0].holder_id is None


async def test_who_may_not_clear_fills_no_journal_and_clearing_nothing_is_no_news(kit: Any) -> None:
    async with played(kit) as (scene, _motor):
        eve, boss = await scene.enters("eve", role="observer"), await scene.enters("boss", role="supervisor")
        eve.stop(reason="fire\nERROR forged")
        await kit.until(lambda: eve.heard("stop.state")[-1].is_stopped)
        for _ in range(4):
            eve.say(control.StopClear())
        await kit.until(lambda: [refusal for refusal in eve.heard("refusal") if refusal.label == control.STOP_LABEL])
        boss.say(control.StopClear())
        await kit.until(lambda: not eve.heard("stop.state")[-1].is_stopped)
        told, heard = len(eve.heard("stop.state")), len(boss.heard("stop.state"))
        boss.say(control.StopClear())
        await kit.until(lambda: len(boss.heard("stop.state")) > heard)
        assert len(eve.heard("stop.state")) == told
        boss.say(control.JournalRead())
        what = [(entry.what, entry.who) for entry in (await boss.hears("journal")).entries]
        assert what.count(("command.refused", "eve")) == 1
        assert what.count(("stop.clear", "boss")) == 1


async def test_a_reason_forges_no_line_of_the_log(kit: Any, caplog: pytest.LogCaptureFixture) -> None:
    async with played(kit) as (scene, motor):
        eve = await scene.enters("eve", role="observer")
        eve.stop(reason="fire\nERROR forged")
        await kit.until(lambda: "safety.stop" in motor.log)
        await eve.stops_ack()
    (line,) = [record.getMessage() for record in caplog.records if "forged" in record.getMessage()]
    assert "\n" not in line
