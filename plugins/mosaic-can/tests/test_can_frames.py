"""Frames as they are: filtered, bounded, and gone with their bus."""

from __future__ import annotations

from typing import Any

import can
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.devices.can_steps import BATTERY_ID, STATE_ID, CanOnSteps, losses

from mosaic_can.frames import CanFramesConfigurer
from mosaic_can.kept_bus import KeptCanBus
from mosaic_can.listener import CanListener
from mosaic_can.opening import OpenBus
from mosaic_can.params import MAX_ID, MAX_STANDARD_ID, CanBusParams, CanFilter
from mosaic_core.testing import build, collect, connector, fake_host, joined
from mosaic_core.words.errors import ConfigError, DeviceGone, MosaicError

IDS = st.integers(0, MAX_STANDARD_ID)


def frame(frame_id: int = STATE_ID, data: bytes = b"\x01\xff", *, extended: bool = False) -> can.Message:
    return can.Message(arbitration_id=frame_id, data=data, is_extended_id=extended)


def test_a_frame_is_told_as_it_was_on_the_bus(steps: CanOnSteps) -> None:
    handler = steps.build(CanFramesConfigurer)
    steps.says(frame(), frame(0x1ABCDEF, b"", extended=True))
    assert [one.model_dump() for one in collect(handler, 2)] == [
        {"id": 0x201, "is_extended": False, "data": "01ff", "is_remote": False},
        {"id": 0x1ABCDEF, "is_extended": True, "data": "", "is_remote": False},
    ]


def test_only_what_the_filters_take_is_told_and_the_rest_is_no_loss(steps: CanOnSteps) -> None:
    handler = steps.build(CanFramesConfigurer, filters=[{"id": 0x200, "mask": 0x7F0}, {"id": 0x555, "extended": True}])
    steps.says(frame(0x101), frame(0x555), frame(STATE_ID), frame(0x555, extended=True), frame(BATTERY_ID))
    assert [one.id for one in collect(handler, 3)] == [STATE_ID, 0x555, BATTERY_ID]
    assert losses(handler) == {}


@given(wanted=IDS, mask=IDS, frame_id=IDS, is_extended=st.booleans(), extended=st.booleans())
def test_a_filter_compares_the_bits_of_its_mask(
    wanted: int, mask: int, frame_id: int, is_extended: bool, extended: bool
) -> None:
    takes = CanFilter(id=wanted, mask=mask, extended=extended).takes(frame_id, is_extended=is_extended)
    assert takes == (is_extended == extended and frame_id & mask == wanted & mask)


@given(wanted=IDS, frame_id=IDS)
def test_a_filter_without_a_mask_takes_one_id(wanted: int, frame_id: int) -> None:
    assert CanFilter(id=wanted).takes(frame_id, is_extended=False) == (wanted == frame_id)


def test_a_flood_is_thinned_and_counted(steps: CanOnSteps) -> None:
    handler = steps.build(CanFramesConfigurer, max_rate_hz=8)
    steps.says(*[frame()] * 300)
    messages = handler.messages()
    taken = [next(messages), next(messages)]
    steps.is_plugged_in = False
    assert not steps.bus.step(0.0)  # ends the body, once it has looked at every frame
    with pytest.raises(DeviceGone):
        taken += list(messages)
    assert len(taken) < 20
    assert losses(handler) == {"thinned": 300 - len(taken)}


def test_what_finds_the_queue_full_pushes_out_the_oldest_and_is_counted() -> None:
    listener = CanListener(lambda frame: True, size=3)
    for number in range(5):
        listener.offer(frame(number))
    frames, dropped = listener.take()
    assert ([one.arbitration_id for one in frames], dropped) == ([2, 3, 4], 2)
    assert listener.take() == ([], 0)


def test_an_adapter_that_is_pulled_out_for_thirty_seconds_is_gone_and_its_return_begins_anew(steps: CanOnSteps) -> None:
    handler = steps.build(CanFramesConfigurer)
    steps.says(frame(1))
    steps.is_plugged_in = False
    assert not steps.bus.step(0.0)
    steps.bus.close()
    for _ in range(6):  # as the robot tries again
        fake_host(handler).clock.advance(5.0)
        with pytest.raises(DeviceGone, match="can't be opened"):
            steps.bus.open()
        with pytest.raises(DeviceGone, match="Network is down"):
            collect(handler, 1)
    steps.is_plugged_in = True
    steps.bus.open()
    steps.says(frame(2))
    assert [one.id for one in collect(handler, 1)] == [2]


async def test_an_operator_of_a_whole_robot_sees_the_bus_that_is_made_up() -> None:
    made = connector(CanFramesConfigurer, label="bus", params={"bus": {"interface": "fake"}})
    async with joined(made) as link:
        assert (await link.connection.receivable("bus").next_message()).json()["id"] == 0x201


def test_two_connectors_that_describe_one_bus_differently_are_told(steps: CanOnSteps) -> None:
    other = {**steps.params.model_dump(), "bitrate": 250_000}
    with pytest.raises(MosaicError, match="differently"):
        build(CanFramesConfigurer, params={"bus": other}, shared=steps.shared)


@pytest.mark.parametrize(
    ("params", "said"),
    [
        ({"bus": {"interface": "socketcam"}}, "did you mean 'socketcan'"),
        ({"filters": [{"id": 0x800}]}, "more than 11 bits"),
        ({"filters": [{"id": 1, "mask": 0x800}]}, "more than 11 bits"),
        ({"filters": [{"id": MAX_ID + 1, "extended": True}]}, "expected a number ≤"),
        ({"bus": {"bitrate": 5}}, "expected a number ≥"),
    ],
)
def test_what_cannot_be_meant_is_refused_at_once(params: dict[str, Any], said: str) -> None:
    with pytest.raises(ConfigError, match=said):
        build(CanFramesConfigurer, params=params)


def test_a_module_that_an_interface_lacks_is_the_cure() -> None:
    def lacks(*_: object) -> OpenBus:
        raise can.CanInterfaceNotImplementedError("msgpack not installed")

    bus = KeptCanBus(CanBusParams(interface="virtual", channel="0"), lacks)
    with pytest.raises(DeviceGone, match="msgpack not installed; pip install msgpack"):
        bus.open()
