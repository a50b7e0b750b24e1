"""Observers, operators, supervisors and programs at a real robot: who commands, who waits, and who may only watch."""

from __future__ import annotations

import asyncio
import time
from typing import Any

import pytest

from mosaic_core.operator import LeaseDenied, LeaseLost

pytestmark = [pytest.mark.netlab, pytest.mark.timeout(90)]

BOUND_S = 0.8
TWIST = {"linear": {"x": 0.4}, "angular": {"z": 0.2}}


async def refusal_of(connection: Any) -> str:
    """What the robot says to a command that leaves this program although it may not."""
    refused: asyncio.Queue[str] = asyncio.Queue()
    connection.on_refusal(lambda refusal: refused.put_nowait(refusal.code))
    pad = connection.sendable("cmd_vel")
    await pad.wait_open()
    assert pad.send_json(TWIST)
    return await asyncio.wait_for(refused.get(), 10)


def test_an_observer_watches_and_stops_but_moves_nothing(site: Any, until: Any) -> None:
    async def body() -> None:
        account = await site.colleague("observer")
        async with site.connected() as holder, site.connected(*account) as observer:
            start_s = time.monotonic()
            with pytest.raises(LeaseDenied) as denied:
                await observer.control.take()
            assert denied.value.code == "lease.forbidden"
            assert await refusal_of(observer) == "lease.forbidden"
            assert site.track.moves(start_s) == []
            await holder.control.take()
            async with site.driving(holder):
                said_s = time.monotonic()
                await observer.control.stop("somebody is in the way")
                await until(lambda: site.track.has_stopped(said_s), "the robot stands")
                assert site.track.stopped_s(said_s) - said_s < BOUND_S
            with pytest.raises(LeaseDenied):
                await observer.control.clear_stop()
            assert await refusal_of(holder) == "safety.stopped"
            await holder.control.clear_stop()
            async with site.driving(holder):
                pass

    site.on_operators_side(body)


def test_only_a_supervisor_with_a_reason_takes_over_by_force(site: Any, until: Any) -> None:
    async def body() -> None:
        account = await site.colleague("operator")
        async with site.connected() as supervisor, site.connected(*account) as operator:
            lease = await operator.control.take()
            with pytest.raises(LeaseDenied) as denied:
                await supervisor.control.take(force=True, reason=" ")
            assert denied.value.code == "lease.force_forbidden"
            async with site.driving(operator):
                said_s = time.monotonic()
                await supervisor.control.take(force=True, reason="it heads for the stairs")
                await until(lambda: lease.lost is not None, "who was driving is told")
                await until(lambda: site.track.has_stopped(said_s), "the robot stands")
                assert site.track.stopped_s(said_s) - said_s < BOUND_S
                with pytest.raises(LeaseDenied) as denied:
                    await operator.control.take(force=True, reason="give it back")
                assert denied.value.code == "lease.force_forbidden"
                assert site.track.moves(site.track.stopped_s(said_s)) == [], "commands went on all the time"
            assert isinstance(lease.lost, LeaseLost)
            assert lease.lost.code == "lease.taken_over"
            entries = await supervisor.control.journal()
            assert any("stairs" in entry.message for entry in entries)
            with pytest.raises(LeaseDenied):
                await operator.control.journal()

    site.on_operators_side(body)


def test_a_program_gives_way_to_a_person_and_never_the_other_way_round(site: Any, until: Any) -> None:
    async def body() -> None:
        async with site.connected() as person, site.connected(is_person=False) as program:
            lease = await program.control.take()
            async with site.driving(program):
                await person.control.take()
                await until(lambda: lease.lost is not None, "the program is told")
                await until(site.track.stands, "the robot stands")
            with pytest.raises(LeaseDenied) as denied:
                await program.control.take()
            assert denied.value.code == "lease.person_commands"
            async with site.driving(person):
                pass

    site.on_operators_side(body)
