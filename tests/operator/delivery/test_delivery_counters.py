"""What a program learns of how data travels: its own counters, and the robot's report while it asks."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest

from mosaic_core.machines.delivery.framing import Frame, PayloadKind, encode_frame
from mosaic_core.words import control

WAIT_S = 30.0


def report(messages: int) -> control.DeliveryReport:
    return control.DeliveryReport(connectors=(control.DeliveryRow(label="chat", messages=messages, dropped=2),))


def watches(world: Any) -> list[bool]:
    return [message.on for message in world.robot.control if isinstance(message, control.DeliveryWatch)]


async def test_commands_that_were_replaced_or_refused_are_counted(world: Any) -> None:
    async with world.operator() as operator:
        connection = await operator.connect(world.robot_id, timeout_s=WAIT_S)
        commands = connection.sendable("cmd_vel")
        assert not commands.send_json({"v": 0})
        await commands.wait_open(WAIT_S)
        channel = world.robot.channels["cmd_vel"]
        commands.send_json({"v": 1})
        channel.buffered_bytes = 100_000
        for v in (2, 3, 4):
            commands.send_json({"v": v})
        channel.buffered_bytes = 0
        channel.on_drained()
        counters = commands.counters
        assert (counters.sent, counters.replaced, counters.refused) == (2, 2, 1)
        assert counters.sent_bytes == len('{"v":1}') * 2


async def test_messages_that_were_missed_or_never_completed_are_counted(world: Any) -> None:
    async with world.operator() as operator:
        connection = await operator.connect(world.robot_id, timeout_s=WAIT_S)
        chat = connection.bidirectional("chat")
        await chat.wait_open(WAIT_S)
        channel = world.robot.channels["chat"]
        for seq in (1, 2, 5):
            channel.deliver(b"{}", seq=seq)
        first, *_ = encode_frame(Frame(PayloadKind.BYTES, b"0123456789", seq=6), 4)
        channel.on_message(first)
        assert (chat.counters.received, chat.counters.arrivals.missed, chat.counters.received_bytes) == (3, 2, 6)
        assert chat.counters.last_received_s is not None
        assert chat.counters.incoming.rates(chat.counters.last_received_s)[0] > 0


async def test_the_robot_reports_while_somebody_asks(world: Any) -> None:
    async with world.operator() as operator:
        connection = await operator.connect(world.robot_id, timeout_s=WAIT_S)
        seen: list[int] = []
        end = connection.delivery.watch(lambda rows: seen.append(rows["chat"].messages))
        waiting = asyncio.create_task(connection.delivery.next_report(WAIT_S))
        await asyncio.sleep(0)
        world.robot.say(report(7))
        assert (await waiting)["chat"].dropped == 2
        world.robot.say(report(8))
        end()
        end()
        world.robot.say(report(9))
        assert seen == [7, 8]
        assert connection.delivery.rows["chat"].messages == 9
        assert watches(world) == [True, False]


async def test_a_robot_that_cannot_tell_is_not_asked(world: Any) -> None:
    del world.robot.extensions["delivery"]
    async with world.operator() as operator:
        connection = await operator.connect(world.robot_id, timeout_s=WAIT_S)
        with pytest.raises(TimeoutError):
            await connection.delivery.next_report(0.02)
        assert not connection.delivery.is_known
        assert watches(world) == []
