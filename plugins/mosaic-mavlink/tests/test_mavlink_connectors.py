"""The connectors by the kit: what they tell, and how they answer an operator."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as words

from mosaic_core.contract.handler import Refused
from mosaic_core.contract.request_handler import Request
from mosaic_core.messages import BatteryState, GpsFix, Imu, Odometry, Range
from mosaic_core.operator import RequestRefused
from mosaic_core.testing import build, collect, connector, fake_host, joined
from mosaic_core.words.errors import DeviceGone
from mosaic_mavlink.control.manual import MavlinkManualConfigurer
from mosaic_mavlink.control.velocity import MavlinkVelocityConfigurer
from mosaic_mavlink.fake.autopilot import FakeAutopilot
from mosaic_mavlink.requests.command import MavlinkCommandConfigurer, VehicleCommand
from mosaic_mavlink.requests.mission import MavlinkMissionConfigurer, MissionItem, MissionQuestion
from mosaic_mavlink.requests.parameters import MavlinkParametersConfigurer, ParameterQuestion
from mosaic_mavlink.telemetry.log import MavlinkLogConfigurer
from mosaic_mavlink.telemetry.odometry import MavlinkOdometryConfigurer
from mosaic_mavlink.telemetry.sensors import (
    MavlinkBatteryConfigurer,
    MavlinkGpsConfigurer,
    MavlinkImuConfigurer,
    MavlinkRangeConfigurer,
)
from mosaic_mavlink.telemetry.state import MavlinkDiagnosticConfigurer, MavlinkStateConfigurer, VehicleState

URL = {"url": "udpin:127.0.0.1:14550"}


@contextmanager
def ticking(air: Any) -> Iterator[None]:
    """Let time pass by itself: whoever asks waits."""
    is_over = threading.Event()

    def tick() -> None:
        while not is_over.wait(0.001):
            air.pass_time(0.05)

    thread = threading.Thread(target=tick)
    thread.start()
    try:
        yield
    finally:
        is_over.set()
        thread.join()


SENDERS: list[tuple[Any, type, dict[str, Any]]] = [
    (MavlinkOdometryConfigurer, Odometry, {}),
    (MavlinkOdometryConfigurer, Odometry, {"position": "global"}),
    (MavlinkImuConfigurer, Imu, {}),
    (MavlinkGpsConfigurer, GpsFix, {}),
    (MavlinkRangeConfigurer, Range, {}),
    (MavlinkBatteryConfigurer, BatteryState, {}),
    (MavlinkStateConfigurer, VehicleState, {}),
]


@pytest.mark.parametrize(("configurer", "kind", "params"), SENDERS)
def test_each_sender_asks_for_its_messages_and_tells_what_came(
    air: Any, copter: FakeAutopilot, configurer: Any, kind: type, params: dict[str, Any]
) -> None:
    handler = build(configurer, params={**URL, **params}, shared=air.shared())
    for wanted in handler.asks_for:
        air.contact().vehicle.rates.want(wanted, 0.1)
    air.pass_time(1.0)
    (told,) = collect(handler, 1)
    assert isinstance(told, kind)
    assert fake_host(handler).losses == {}


def test_nothing_is_told_twice(air: Any, copter: FakeAutopilot) -> None:
    handler = build(MavlinkBatteryConfigurer, params=URL, shared=air.shared())
    air.pass_time(1.1)
    with pytest.raises(AssertionError):
        collect(handler, 2, within_s=30.0)


def test_a_diagnostic_is_of_the_newest_status(air: Any, copter: FakeAutopilot) -> None:
    copter.instruments.unwell = 1 << 5
    air.pass_time(1.1)
    (told,) = collect(build(MavlinkDiagnosticConfigurer, params=URL, shared=air.shared()), 1)
    assert (told.level, told.message) == ("warn", "gps")


def test_the_state_has_the_modes_that_may_be_asked_for(air: Any, copter: FakeAutopilot) -> None:
    (state,) = collect(build(MavlinkStateConfigurer, params=URL, shared=air.shared()), 1)
    assert (state.mode, state.armed, state.system_id) == ("LOITER", False, 1)
    assert "GUIDED" in state.modes


def test_texts_are_told_once_in_order_and_what_was_forgotten_is_counted(air: Any, copter: FakeAutopilot) -> None:
    handler = build(MavlinkLogConfigurer, params=URL, shared=air.shared())
    (first,) = collect(handler, 1)
    assert first.message == "A vehicle that is made up is ready"
    for number in range(150):
        copter.say(6, f"text {number}")
    air.pass_time(0.1)
    told = collect(handler, 100)
    assert [one.message for one in told] == [f"text {number}" for number in range(50, 150)]
    assert fake_host(handler).losses == {"lost": 50}


def test_a_vehicle_that_is_away_is_a_device_that_is_gone(air: Any, copter: FakeAutopilot) -> None:
    handlers: list[Any] = [
        build(one, params=URL, shared=air.shared()) for one in (MavlinkStateConfigurer, MavlinkLogConfigurer)
    ]
    air.silent.add(1)
    air.pass_time(4.0)
    for handler in handlers:
        with pytest.raises(DeviceGone, match="no heartbeat"):
            collect(handler, 1)


@pytest.mark.parametrize(
    ("question", "reason"),
    [
        ({"action": "mode"}, "needs a mode"),
        ({"action": "takeoff"}, "needs an altitude_m"),
        ({"action": "arm", "forced": True}, "only with a reason"),
        ({"action": "land", "forced": True, "reason": "because"}, "only arm and disarm"),
        ({"action": "takeoff", "altitude_m": -3}, "greater than or equal to 0"),
        ({"action": "kill"}, "'arm', 'disarm'"),
    ],
)
def test_commands_that_make_no_sense_are_refused(question: dict[str, Any], reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        VehicleCommand.model_validate(question)


def test_questions_that_make_no_sense_are_refused() -> None:
    for wrong in ({"action": "get"}, {"action": "set", "name": "A"}, {"action": "get", "name": "A" * 17}):
        with pytest.raises(ValueError, match=r"name|value"):
            ParameterQuestion.model_validate(wrong)
    with pytest.raises(ValueError, match="did you mean 'NAV_WAYPOINT'"):
        MissionItem(command="NAV_WAYPOIN")
    other = MissionItem(frame="other")
    with pytest.raises(ValueError, match="item 0 has the frame other"):
        MissionQuestion(action="upload", items=[other])


@pytest.mark.parametrize(
    ("configurer", "question"),
    [
        (MavlinkCommandConfigurer, VehicleCommand(action="mode", mode="ALT_HOLD")),
        (MavlinkParametersConfigurer, ParameterQuestion(action="list")),
        (MavlinkMissionConfigurer, MissionQuestion(action="download")),
    ],
)
def test_what_is_asked_of_a_vehicle_that_is_away_for_thirty_seconds_is_refused_and_then_answered(
    air: Any, copter: FakeAutopilot, configurer: Any, question: Any
) -> None:
    desk = build(configurer, params=URL, shared=air.shared())
    air.silent.add(1)
    for _ in range(6):
        air.pass_time(5.0)
        with pytest.raises(Refused) as refused:
            desk.answer(question, Request())
        assert refused.value.code == "plugin.no_device"
    air.silent.clear()
    air.pass_time(1.5)
    with ticking(air):
        assert desk.answer(question, Request())


def test_an_unknown_mode_is_told_with_the_nearest(air: Any, copter: FakeAutopilot) -> None:
    desk = build(MavlinkCommandConfigurer, params=URL, shared=air.shared())
    with pytest.raises(Exception, match=r"a copter has no mode GUIDE; did you mean 'GUIDED'\? It has: "):
        desk.answer(VehicleCommand(action="mode", mode="guide"), Request())
    with pytest.raises(Exception, match="it takes off in GUIDED, and is in LOITER"):
        desk.answer(VehicleCommand(action="takeoff", altitude_m=5.0), Request())


@pytest.mark.parametrize(("kind", "guided"), [("copter", "GUIDED"), ("px4", "OFFBOARD")])
async def test_an_operator_arms_takes_off_flies_and_lands(kind: str, guided: str) -> None:
    params = {"url": f"fake:{kind}"}
    entries = [
        connector(MavlinkStateConfigurer, label="state", params=params),
        connector(MavlinkOdometryConfigurer, label="odometry", params={**params, "period_s": 0.05}),
        connector(MavlinkCommandConfigurer, label="command", params=params),
        connector(
            MavlinkVelocityConfigurer, label="velocity", params={**params, "on_loss_after_s": 0},
            safety={"slow_down": "off"},
        ),
        connector(MavlinkManualConfigurer, label="sticks", params=params),
    ]  # fmt: skip
    async with joined(*entries, takes_leases=True) as link:
        state, odometry = link.connection.receivable("state"), link.connection.receivable("odometry")
        await state.next_message()
        await odometry.next_message()

        async def do(**question: Any) -> Any:
            return await link.connection.request("command", question)

        steps: list[dict[str, Any]] = [{"action": "mode", "mode": guided}, {"action": "arm"}]
        if kind == "px4":
            steps = [steps[1], {"action": "takeoff", "altitude_m": 2.0}, steps[0]]
        else:
            steps.append({"action": "takeoff", "altitude_m": 2.0})
        for step in steps:
            assert (await do(**step))["said"] == []
        velocity = link.connection.sendable("velocity")
        await velocity.wait_open()
        while (moved := (await odometry.next_message()).json())["twist"]["linear"]["x"] < 0.2:
            velocity.send_json({"linear": {"x": 1.0}})
        assert moved["position"]["z"] > 0.0
        while (told := (await state.next_message()).json())["mode"] == guided:
            pass  # nobody sends any more
        assert told["mode"] in ("BRAKE", "HOLD")
        assert (await do(action="land"))["did"] == "mode LAND"
        while (await state.next_message()).json()["mode"] != "LAND":
            pass


async def test_parameters_and_missions_are_answered_and_refusals_have_words() -> None:
    params = {"url": "fake:"}
    entries = [
        connector(MavlinkStateConfigurer, label="state", params=params),
        connector(MavlinkParametersConfigurer, label="parameters", params=params),
        connector(MavlinkMissionConfigurer, label="mission", params=params),
        connector(MavlinkCommandConfigurer, label="command", params=params),
    ]
    async with joined(*entries, takes_leases=True) as link:
        ask = link.connection.request
        await link.connection.receivable("state").next_message()
        told: list[Any] = []
        listed = await ask("parameters", {"action": "list"}, on_progress=told.append)
        assert [one["name"] for one in listed["parameters"]][:2] == ["WPNAV_SPEED", "FENCE_ENABLE"]
        await ask("parameters", {"action": "set", "name": "RTL_ALT", "value": 2000})
        (got,) = (await ask("parameters", {"action": "get", "name": "RTL_ALT"}))["parameters"]
        assert got == {"name": "RTL_ALT", "value": 2000.0, "whole": True, "said": ""}
        items: list[dict[str, Any]] = [
            {"latitude": 47.4, "longitude": 8.5 + at / 100, "altitude_m": 20} for at in range(3)
        ]
        items.append({"command": "NAV_RETURN_TO_LAUNCH", "frame": "mission"})
        up = await ask("mission", {"action": "upload", "items": items}, on_progress=told.append)
        down = await ask("mission", {"action": "download"})
        assert down == up
        assert [one["command"] for one in down["items"]] == ["NAV_WAYPOINT"] * 3 + ["NAV_RETURN_TO_LAUNCH"]
        assert {one["total"] for one in told} == {5}  # with home; not each step is told
        assert (await ask("mission", {"action": "clear"}))["items"] == []
        with pytest.raises(RequestRefused, match="takes off in GUIDED"):
            await ask("command", {"action": "takeoff", "altitude_m": 3})


def test_a_parameter_that_is_no_number_is_null_with_what_the_vehicle_says(air: Any, copter: FakeAutopilot) -> None:
    copter.parameters.values = {
        "A": (float("nan"), words.MAV_PARAM_TYPE_REAL32),
        "B": (0.0, words.MAV_PARAM_TYPE_REAL32),
    }
    desk = build(MavlinkParametersConfigurer, params=URL, shared=air.shared())
    with ticking(air):
        answer = desk.answer(ParameterQuestion(action="list"), Request())
    assert [(one.name, one.value, one.said) for one in answer.parameters] == [("A", None, "nan"), ("B", 0.0, "")]
    assert '"value":null' in answer.model_dump_json()


async def test_who_has_no_lease_changes_nothing() -> None:
    entry = connector(MavlinkCommandConfigurer, label="command", params={"url": "fake:"})
    async with joined(entry) as link:
        with pytest.raises(RequestRefused) as refused:
            await link.connection.request("command", {"action": "arm"})
        assert refused.value.code.startswith("lease.")
