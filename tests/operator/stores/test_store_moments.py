"""The documented words of a store: moments to subscribe to and to override, a class of one's own, what can be sent."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest
from pydantic import BaseModel

from mosaic_core.operator import BidirectionalStore, MosaicStore, ReceivableStore, RobotConnector, SendableStore
from mosaic_core.words.data_type import MosaicDataType
from mosaic_core.words.errors import ConnectionFailed

WAIT_S = 30.0
MOMENTS = ("before_connected", "after_connected", "after_disconnected", "after_connection_failed")


def go_through(store: MosaicStore) -> None:
    store.opening()
    store.opened()
    store.closed()
    store.failed(ConnectionFailed("no", code="media.no_line"))


@pytest.mark.parametrize("moment", MOMENTS)
async def test_each_moment_is_told_to_who_subscribed_until_they_end_it(moment: str) -> None:
    store, heard = ReceivableStore(RobotConnector("r", "odom")), list[str]()
    end = getattr(store, f"on_{moment}")(lambda: heard.append(moment))
    go_through(store)
    end()
    end()
    go_through(store)
    assert heard == [moment]


async def test_a_store_class_of_ones_own_overrides_the_moments() -> None:
    heard: list[str] = []

    class Mine(ReceivableStore):
        def before_connected(self) -> None:
            heard.append("before")

        def after_connected(self) -> None:
            heard.append("connected")

        def after_disconnected(self) -> None:
            heard.append("disconnected")

        def after_connection_failed(self) -> None:
            heard.append("failed")

    go_through(Mine(RobotConnector("r", "odom")))
    assert heard == ["before", "connected", "disconnected", "failed"]


async def test_classes_that_override_the_words_of_before_are_told_too() -> None:
    heard: list[str] = []

    class Mine(ReceivableStore):
        def on_after_connected(self) -> None:  # type: ignore[override]
            heard.append("connected")

    go_through(Mine(RobotConnector("r", "odom")))
    assert heard == ["connected"]


@pytest.mark.parametrize("match", [{"connector_type": "battery"}, {"label": "battery"}, {"data_type": "json-r2u"}, {}])
async def test_a_class_of_ones_own_is_registered_in_one_line(world: Any, match: dict[str, Any]) -> None:
    class BatteryStore(ReceivableStore):
        data_type = MosaicDataType.JSON_R2U
        is_charged = False

        def after_connected(self) -> None:
            self.is_charged = True

    async with world.operator() as operator:
        operator.stores.register_mosaic_store(BatteryStore, **match)
        connection = await operator.connect(world.robot_id, timeout_s=WAIT_S)
        store = connection.receivable("battery")
        assert isinstance(store, BatteryStore)
        await store.wait_open(WAIT_S)
        assert store.is_charged
        assert type(connection.bidirectional("chat")) is BidirectionalStore


async def test_a_label_counts_more_than_a_type_and_that_more_than_a_data_type(world: Any) -> None:
    class ByLabel(ReceivableStore): ...

    class ByType(ReceivableStore): ...

    class ByDataType(ReceivableStore): ...

    async with world.operator() as operator:
        operator.stores.register_mosaic_store(ByLabel, label="battery")
        operator.stores.register_mosaic_store(ByType, connector_type="battery")
        operator.stores.register_mosaic_store(ByDataType, data_type="json-r2u")
        connection = await operator.connect(world.robot_id, timeout_s=WAIT_S)
        assert type(connection.receivable("battery")) is ByLabel


async def test_a_class_that_says_nothing_of_itself_has_to_be_told_for_what_it_is(world: Any) -> None:
    async with world.operator() as operator:
        with pytest.raises(TypeError, match="label='battery'"):
            operator.stores.register_mosaic_store(ReceivableStore)


async def test_a_store_that_only_lingers_makes_room_for_one_of_another_class(world: Any) -> None:
    class BatteryStore(ReceivableStore): ...

    async with world.operator() as operator:
        connection = await operator.connect(world.robot_id, timeout_s=WAIT_S)
        connection.receivable("battery")
        battery = RobotConnector(world.robot_id, "battery")
        operator.stores.release_store(battery)
        assert type(operator.stores.get_or_create_store(battery, BatteryStore)) is BatteryStore


async def test_a_class_is_had_by_asking_for_it_and_only_once_per_connector(world: Any) -> None:
    class BatteryStore(ReceivableStore): ...

    async with world.operator() as operator:
        battery = RobotConnector(world.robot_id, "battery")
        store = operator.stores.get_or_create_store(battery, BatteryStore)
        assert type(store) is BatteryStore
        with pytest.raises(ConnectionFailed, match="has a BatteryStore already, no SendableStore"):
            operator.stores.get_or_create_store(battery, SendableStore)


class Lamp(BaseModel):
    is_on: bool


@pytest.mark.parametrize(
    ("data", "payload"),
    [
        ({"is_on": True}, b'{"is_on":true}'),
        (Lamp(is_on=True), b'{"is_on":true}'),
        ([1, 2], b"[1,2]"),
        ('{"is_on": true}', b'{"is_on": true}'),
        (b"\x00\x01", b"\x00\x01"),
    ],
)
def test_what_is_sent_is_an_object_a_text_or_bytes(data: Any, payload: bytes) -> None:
    store, sent = SendableStore(RobotConnector("r", "lamp", "json-u2r")), list[bytes]()

    def take(_: object, payload: bytes) -> bool:
        sent.append(payload)
        return True

    store.connect_outlet(take)
    assert store.send_data(data)
    assert sent == [payload]


def test_an_object_that_is_no_json_is_the_callers_mistake() -> None:
    store = SendableStore(RobotConnector("r", "lamp", "json-u2r"))
    store.connect_outlet(lambda kind, given: True)
    with pytest.raises(ValueError, match="JSON"):
        store.send_data({"x": float("nan")})


async def test_a_target_is_said_while_the_block_runs_and_no_longer() -> None:
    store, said, thrice = SendableStore(RobotConnector("r", "joints", MosaicDataType.JSON_U2R)), [], asyncio.Event()

    def outlet(_: object, payload: bytes) -> bool:
        said.append(payload)
        if len(said) == 3:
            thrice.set()
        return True

    store.connect_outlet(outlet)
    before = asyncio.all_tasks()
    async with store.held({"position": 0.5}, period_s=0.001):
        assert said == [b'{"position":0.5}']  # at once
        async with asyncio.timeout(WAIT_S):
            await thrice.wait()
    assert asyncio.all_tasks() == before  # nobody is left who could say it
    assert set(said) == {b'{"position":0.5}'}


async def test_what_becomes_no_json_while_it_is_held_is_told_at_the_end() -> None:
    store = SendableStore(RobotConnector("r", "joints", MosaicDataType.JSON_U2R))
    target = {"position": 0.5}

    async def spoiled() -> None:
        async with store.held(target, period_s=0):
            target["position"] = float("nan")
            for _ in range(3):
                await asyncio.sleep(0)

    with pytest.raises(ValueError, match="JSON"):
        await spoiled()


async def test_an_error_of_the_block_goes_before_that_of_what_was_held_and_tells_both() -> None:
    store = SendableStore(RobotConnector("r", "joints", MosaicDataType.JSON_U2R))
    target = {"position": 0.5}

    async def spoiled() -> None:
        async with store.held(target, period_s=0):
            target["position"] = float("nan")
            for _ in range(3):
                await asyncio.sleep(0)
            raise LookupError("of the block")

    with pytest.raises(LookupError, match="of the block") as caught:
        await spoiled()
    assert any("JSON" in note for note in caught.value.__notes__)


async def test_what_is_no_json_is_not_held() -> None:
    store = SendableStore(RobotConnector("r", "joints", MosaicDataType.JSON_U2R))
    with pytest.raises(ValueError, match="JSON"):
        async with store.held({"position": float("nan")}):
            pass
