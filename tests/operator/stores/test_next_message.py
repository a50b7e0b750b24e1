"""Who waits for a message gets it, or hears why none comes."""

from __future__ import annotations

import asyncio

import pytest

from mosaic_core.operator.delivery.data_port import MessageInfo
from mosaic_core.operator.stores.robot_connector import RobotConnector
from mosaic_core.operator.stores.stores import ReceivableStore
from mosaic_core.words.errors import ConnectionFailed


@pytest.fixture
def store() -> ReceivableStore:
    return ReceivableStore(RobotConnector("robot", "scan"))


async def test_the_next_message_is_waited_for_through_a_lost_connection(store: ReceivableStore) -> None:
    waiting = asyncio.create_task(store.next_message())
    await asyncio.sleep(0)
    store.opened()
    store.interrupted()
    await asyncio.sleep(0)
    store.notify_subscribers(b"x", MessageInfo(0.0))
    assert (await waiting).data == b"x"


async def test_nothing_is_waited_for_once_the_connection_is_over(store: ReceivableStore) -> None:
    store.opened()
    waiting = asyncio.create_task(store.next_message())
    await asyncio.sleep(0)
    store.closed()
    with pytest.raises(ConnectionFailed) as caught:
        await waiting
    assert caught.value.code == "peer.closed"
    with pytest.raises(TimeoutError, match=r"within 0\.01 s; it is closed$"):
        await store.next_message(0.01)


async def test_a_store_that_is_closed_may_be_opened_by_the_next_connection(store: ReceivableStore) -> None:
    store.closed()
    waiting = asyncio.create_task(store.next_message())
    await asyncio.sleep(0)
    store.opened()
    store.notify_subscribers(b"x", MessageInfo(0.0))
    assert (await waiting).data == b"x"


async def test_what_the_robot_does_not_have_is_told_at_once(store: ReceivableStore) -> None:
    store.failed(ConnectionFailed("the robot has no 'scan'", code="channel.unknown_label"))
    with pytest.raises(ConnectionFailed, match="the robot has no 'scan'"):
        await store.next_message()


async def test_who_waits_too_long_is_told_what_for_and_how_it_stands(store: ReceivableStore) -> None:
    with pytest.raises(TimeoutError, match=r"^no message of 'scan' within 0\.01 s; it is waiting$"):
        await store.next_message(0.01)
    store.opened()
    with pytest.raises(TimeoutError, match=r"^no message of 'scan' within 0\.01 s$"):
        await store.next_message(0.01)
