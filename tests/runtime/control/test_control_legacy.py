"""Original dashboards, which know no lease: allowed while nobody else commands, watching only, or refused."""

from __future__ import annotations

import json
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import pytest
from support.connectors import Motor

from mosaic_core.words import control
from mosaic_core.words.control import CONTROL_EXTENSIONS, CONTROL_LABEL, Hello


@asynccontextmanager
async def played(kit: Any, mode: str, expiry_s: float = 2.0) -> AsyncIterator[Any]:
    motor = Motor(requires_lease=True)
    config = {"legacy_peers": mode, "lease_expiry_s": expiry_s}
    async with kit.running(kit.connector_of(motor), control=config) as scene:
        yield scene, motor


async def test_it_holds_the_lease_while_it_commands_and_loses_it_by_silence(kit: Any) -> None:
    async with played(kit, "allow", expiry_s=0.5) as (scene, motor):
        ann = await scene.enters("ann")
        end = await scene.connects("old")
        drive = end.open("drive", "")
        drive.say({"v": 1})
        await kit.until(lambda: motor.log == [1])
        await kit.until(lambda: ann.heard("lease.state")[-1].holder is not None)
        holder = ann.heard("lease.state")[-1].holder
        assert (holder.name, holder.is_original) == ("old", True)
        await kit.until(lambda: motor.log == [1, "safety.lease_lost"])
        await kit.until(lambda: ann.heard("lease.state")[-1].holder is None)
        drive.say({"v": 2})
        await kit.until(lambda: motor.log[-1] == 2)


async def test_it_does_not_command_while_somebody_holds_the_lease(kit: Any) -> None:
    async with played(kit, "allow") as (scene, motor):
        ann = await scene.enters("ann")
        await ann.take()
        drive = (await scene.connects("old")).open("drive", "")
        drive.say({"v": "original"})
        await kit.until(lambda: scene.hooks.of("command"))
        assert scene.hooks.of("command")[-1]["code"] == "lease.not_holder"
        ann.say(control.LeaseRelease())
        await kit.until(lambda: ann.heard("lease.state")[-1].holder is None)
        drive.say({"v": 1})
        await kit.until(lambda: motor.log == [1])


async def test_a_person_of_ours_waits_for_it_like_for_anybody(kit: Any) -> None:
    async with played(kit, "allow") as (scene, motor):
        drive = (await scene.connects("old")).open("drive", "")
        drive.say({"v": 1})
        await kit.until(lambda: motor.log == [1])
        ann, boss = await scene.enters("ann"), await scene.enters("boss", role="supervisor")
        await boss.take(force=True, reason="enough")
        await kit.until(lambda: motor.log == [1, "safety.lease_lost"])
        drive.say({"v": "original"})
        await kit.until(lambda: scene.hooks.of("command")[-1]["code"] == "lease.not_holder")
        assert ann.heard("lease.state")[-1].holder.name == "boss"


async def test_it_watches_where_the_robot_says_so(kit: Any) -> None:
    async with played(kit, "observe") as (scene, motor):
        drive = (await scene.connects("old")).open("drive", "")
        drive.say({"v": 1})
        await kit.until(lambda: scene.hooks.of("command"))
        assert scene.hooks.of("command")[-1] == {
            "label": "drive", "accepted": False, "code": "lease.original_observes",
        }  # fmt: skip
        assert motor.log == []


async def test_it_is_refused_where_the_robot_says_so(kit: Any) -> None:
    async with played(kit, "refuse") as (scene, motor):
        end = await scene.connects("old")
        end.open("drive", "").say({"v": 1})
        await kit.until(lambda: end.is_closed)
        assert scene.hooks.of("closed")[-1]["code"] == "peer.not_allowed"
        assert motor.log == []


async def test_an_offer_without_a_line_for_channels_is_that_of_an_original_too(kit: Any) -> None:
    async with played(kit, "refuse") as (scene, _motor):
        end = await scene.connects("old", offer="m=video 9 UDP/TLS/RTP/SAVPF 96")
        await kit.until(lambda: end.is_closed)
        assert scene.hooks.of("closed")[-1]["code"] == "peer.not_allowed"


async def test_who_has_opened_a_channel_of_ours_is_not_taken_for_an_original_by_a_bare_one(kit: Any) -> None:
    async with played(kit, "refuse") as (scene, motor):
        end = await scene.connects("slow")
        channel = end.open(CONTROL_LABEL)
        end.open("drive", "").say({"v": 1})
        await kit.until(lambda: scene.hooks.of("command"))
        assert scene.hooks.of("command")[-1]["code"] == "lease.original_observes"
        hello = Hello(software="slow", boot_id="b", extensions=CONTROL_EXTENSIONS, is_person=True)
        channel.say({"type": "hello", "data": hello.wire()})
        await kit.until(lambda: [value for value in channel.values() if value["type"] == "stop.state"])
        assert not end.is_closed
        assert motor.log == []


@pytest.mark.parametrize("mode", ["observe", "refuse"])
async def test_who_has_not_said_hello_yet_commands_nothing_where_originals_may_not(kit: Any, mode: str) -> None:
    winch = Motor()

    async with kit.running(kit.connector_of(winch), control={"legacy_peers": mode}) as scene:
        end = await scene.connects("mute")
        channel = end.open("drive")
        channel.say({"v": 1})
        await kit.until(lambda: scene.hooks.of("command"))
        assert scene.hooks.of("command")[0]["code"] == "lease.original_observes"
        end.open(CONTROL_LABEL).say(
            json.loads(Hello(software="test", boot_id="b", extensions=CONTROL_EXTENSIONS).to_text())
        )
        channel.say({"v": 2})
        await kit.until(lambda: winch.log == [2])


async def test_a_hello_without_leases_is_that_of_an_original(kit: Any) -> None:
    async with played(kit, "allow") as (scene, motor):
        ann = await scene.enters("ann")
        end = await scene.connects("older")
        channel = end.open(CONTROL_LABEL)
        channel.say({"type": "hello", "data": Hello(software="older", boot_id="b").wire()})
        await kit.until(lambda: len(ann.heard("peers")[-1].peers) == 2)
        assert [info.is_original for info in ann.heard("peers")[-1].peers] == [False, True]
        end.open("drive").say({"v": 1})
        await kit.until(lambda: motor.log == [1])
        assert "lease.state" not in [value["type"] for value in channel.values()]


async def test_a_late_hello_makes_it_one_of_ours(kit: Any) -> None:
    async with played(kit, "allow") as (scene, motor):
        end = await scene.connects("late")
        drive = end.open("drive", "")
        drive.say({"v": 1})
        await kit.until(lambda: motor.log == [1])
        channel = end.open(CONTROL_LABEL)
        hello = Hello(software="late", boot_id="b", extensions={"lease": 1}, is_person=True)
        channel.say({"type": "hello", "data": hello.wire()})
        await kit.until(lambda: [value for value in channel.values() if value["type"] == "stop.state"])
        drive.say({"v": "no epoch"})
        await kit.until(lambda: scene.hooks.of("command")[-1]["code"] == "lease.required")
        assert motor.log == [1]
