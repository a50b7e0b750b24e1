"""Commands on a bus: within the DBC file's ranges, and the safe frame at both ends and in between."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import can
import cantools.database
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.devices.absence import thirty_seconds
from support.devices.can_steps import COMMAND_ID, CanOnSteps, error_frame

from mosaic_can.command_frame import CommandFrame
from mosaic_can.databases import CanDatabase
from mosaic_can.kept_bus import ERROR_BUS_OFF, ERROR_RESTARTED
from mosaic_can.send import CanSendConfigurer
from mosaic_core.testing import Leaves, LosesLease, Silence, Stopped, build, connector, fake_host, feed, joined, until
from mosaic_core.words.errors import DeviceGone, MosaicError, Refused

SAMPLE = CanDatabase(["sample"])
COMMAND = SAMPLE.by_name["DriveCommand"]
DRIVE: dict[str, Any] = {
    "message": "DriveCommand",
    "kinds": {"left_mps": "velocity", "right_mps": "velocity"},
    "fixed": {"enabled": True},
    "counter": "counter",
    "safe": {"enabled": False},
}
FORWARD = {"left_mps": 0.5, "right_mps": 0.25}
FAST = {"slow_down": "off"}


def drive(steps: CanOnSteps, safety: Any = None, **params: Any) -> Any:
    return steps.build(CanSendConfigurer, {**FAST, **(safety or {})}, **{**DRIVE, **params})


@pytest.fixture
def opened() -> Iterator[CanOnSteps]:
    """A bus that a test opens itself, once it has its handlers."""
    steps = CanOnSteps()
    yield steps
    steps.bus.close()
    steps.node.shutdown()


def said(frames: list[can.Message]) -> list[tuple[float, float, int]]:
    """Speeds and the flag of each command."""
    told = []
    for one in frames:
        assert (one.arbitration_id, one.is_extended_id) == (COMMAND_ID, False)
        values: Any = COMMAND.decode(bytes(one.data))
        told.append((values["left_mps"], values["right_mps"], values["enabled"]))
    return told


SAFE = (0.0, 0.0, 0)


@pytest.mark.parametrize("end", [Silence(0.6), Leaves(), LosesLease(), Stopped()])
def test_a_command_is_a_frame_and_its_operators_absence_sends_the_safe_one(opened: CanOnSteps, end: Any) -> None:
    handler = drive(opened)
    opened.bus.open()
    fed = feed(handler, [FORWARD, end])
    assert len(fed.accepted) == 1
    first, command, *rest = said(opened.heard())
    assert (first, command) == (SAFE, (0.5, 0.25, 1))
    assert set(rest) == {SAFE}


def test_frames_are_counted_in_the_signal_that_counts(opened: CanOnSteps) -> None:
    handler = drive(opened)
    opened.bus.open()
    feed(handler, [step for _ in range(20) for step in (FORWARD, Silence(0.05))])
    decoded: list[Any] = [COMMAND.decode(bytes(one.data)) for one in opened.heard()]
    counts = [one["counter"] for one in decoded]
    assert counts[:20] == [*range(16), 0, 1, 2, 3]


def test_what_moves_stays_within_the_dbc_file_and_what_does_not_is_refused_beyond_it(opened: CanOnSteps) -> None:
    handler = drive(opened, kinds={"left_mps": "velocity"}, safe={"enabled": False, "right_mps": 0.0})
    opened.bus.open()
    fed = feed(
        handler,
        [{"left_mps": 9.0, "right_mps": 0.0}, {"left_mps": 0.0, "right_mps": 1.6}, {"left_mps": 0.1}, b"\xff",
         '{"left_mps": NaN, "right_mps": 0}', {"left_mps": 0.0, "right_mps": "fast"}],
    )  # fmt: skip
    assert said(opened.heard())[1] == (1.5, 0.0, 1)
    assert len(fed.refused) == 5


def test_limits_of_the_robots_file_narrow_and_never_widen_the_range(opened: CanOnSteps) -> None:
    narrow = drive(opened, {"limits": {"left_mps": {"min": -0.3, "max": 0.3}}})
    wide = drive(opened, {"limits": {"left_mps": {"min": -9, "max": 9}}})
    opened.bus.open()
    opened.heard()
    feed(narrow, [{"left_mps": 1.0, "right_mps": 0}])
    assert said(opened.heard())[0] == (0.3, 0.0, 1)
    fed = feed(wide, [{"left_mps": 2.0, "right_mps": 0}])
    assert [one.code for one in fed.refused] == ["safety.out_of_range"]
    assert set(said(opened.heard())) <= {SAFE}


def test_while_the_bus_is_away_for_thirty_seconds_commands_are_refused_and_its_return_begins_with_the_safe_frame(
    opened: CanOnSteps,
) -> None:
    handler = drive(opened)
    fed = feed(handler, [FORWARD])
    assert [one.code for one in fed.refused] == ["plugin.no_device"]
    opened.bus.open()
    opened.heard()
    opened.is_plugged_in = False
    assert not opened.bus.step(0.0)
    opened.bus.close()
    for _ in thirty_seconds(fake_host(handler).clock):
        with pytest.raises(DeviceGone, match="can't be opened"):
            opened.bus.open()
        assert [one.code for one in feed(handler, [FORWARD, Stopped()]).refused] == ["plugin.no_device"]
    opened.is_plugged_in = True
    opened.bus.open()
    opened.bus.close()
    assert said(opened.heard()) == [SAFE, SAFE]  # opened, closed


def test_after_bus_off_nothing_is_sent_until_it_is_back_and_then_the_safe_frame_first(opened: CanOnSteps) -> None:
    handler = drive(opened)
    opened.bus.open()
    opened.heard()
    opened.says(error_frame(0x4))
    assert (opened.bus.error_frames, opened.bus.keeper.absence) == (1, None)
    opened.says(error_frame(ERROR_BUS_OFF))
    fed = feed(handler, [FORWARD, Stopped()])
    assert "bus-off" in fed.refused[0].message
    assert "bus-off" in str(handler.keeper.absence), "as everybody sees it"
    assert opened.heard() == []
    opened.says(error_frame(ERROR_RESTARTED))
    assert said(opened.heard()) == [SAFE]
    feed(handler, [FORWARD])
    assert said(opened.heard())[0] == (0.5, 0.25, 1)


def test_an_adapter_that_says_that_its_controller_is_off_is_opened_again(opened: CanOnSteps) -> None:
    opened.bus.open()
    opened.state = can.BusState.ERROR
    assert not opened.bus.step(0.0)
    assert "bus-off" in str(opened.bus.keeper.absence)


def test_a_bus_that_takes_nothing_owes_the_safe_frame_and_takes_no_command_before_it(opened: CanOnSteps) -> None:
    handler = drive(opened)
    opened.is_full = True
    opened.bus.open()
    assert "safe frames" in feed(handler, [FORWARD]).refused[0].message
    opened.is_full = False
    assert opened.bus.step(0.0)
    assert said(opened.heard()) == [SAFE]
    opened.is_full = True
    with pytest.raises(Refused, match="another node"):
        handler.make_safe("safety.timeout")  # the robot tries again


def test_a_safe_frame_that_finds_no_room_at_the_end_is_no_error(opened: CanOnSteps) -> None:
    drive(opened)
    opened.bus.open()
    opened.is_full = True
    opened.bus.close()
    opened.bus.close()


def test_what_moves_nothing_and_has_no_safe_values_has_no_safe_frame(opened: CanOnSteps) -> None:
    handler = drive(opened, kinds={}, fixed={"enabled": True, "left_mps": 0, "right_mps": 0}, safe={}, counter=None)
    opened.bus.open()
    fed = feed(handler, [{"counter": 3}, Stopped()])
    assert (len(fed.accepted), handler.timeout_s) == (1, None)
    assert len(opened.heard()) == 1


@given(
    length=st.integers(2, 32), signed=st.booleans(), scale=st.sampled_from([1, 0.1, 0.001, 0.25, 2, 0.0078125]),
    offset=st.sampled_from([0, -40, 0.5]), share=st.floats(0, 1), big=st.booleans(),
)  # fmt: skip
def test_every_value_within_the_range_can_be_sent_and_comes_back_as_it_was(
    length: int, signed: bool, scale: float, offset: float, share: float, big: bool
) -> None:
    start, order = (7, 0) if big else (0, 1)
    line = f"SG_ value : {start}|{length}@{order}{'-' if signed else '+'} ({scale},{offset}) [0|0]"
    text = f'VERSION ""\nBO_ 16 Free: 4 BASE\n {line} "" ROBOT\n'
    described = cantools.database.load_string(text, "dbc").messages[0]  # type: ignore[union-attr]
    frame = CommandFrame(described, {"value": "position"}, {}, {"value": offset}, None)
    bounds = frame.limits()["value"]
    assert bounds.min is not None
    assert bounds.max is not None
    value = min(max(bounds.min + share * (bounds.max - bounds.min), bounds.min), bounds.max)
    back: Any = described.decode(bytes(frame.of({"value": value}).data))
    assert abs(back["value"] - value) <= scale / 2 + 1e-6 * abs(value)


@pytest.mark.parametrize(
    ("params", "told"),
    [
        ({"message": "DriveComand"}, "did you mean 'DriveCommand'"),
        ({"kinds": {"left": "velocity"}}, "no signal 'left'"),
        ({"counter": "left_mps"}, "can't count"),
        ({"safe": {}, "fixed": {}}, "says nothing of enabled"),
        ({"safe": {"left_mps": 5}}, "safe: "),
        ({"message": "DriveState", "kinds": {"mode": "position"}, "fixed": {}, "safe": {}, "counter": None}, "words"),
    ],
)
def test_what_the_dbc_file_cannot_follow_is_told_before_anything_starts(params: dict[str, Any], told: str) -> None:
    bus = {"interface": "fake", "dbc": "sample"}
    with pytest.raises(MosaicError, match=told):
        build(CanSendConfigurer, params={"bus": bus, **DRIVE, **params})


def test_a_velocity_must_have_a_standstill_and_what_is_multiplexed_is_not_commanded(tmp_path: Path) -> None:
    file = tmp_path / "pump.dbc"
    file.write_text(
        'VERSION ""\nBO_ 1 Pump: 1 BASE\n SG_ speed : 0|8@1+ (1,0) [10|200] "rpm" ROBOT\n\n'
        'BO_ 2 Cells: 2 BASE\n SG_ page M : 0|8@1+ (1,0) [0|1] "" ROBOT\n SG_ a m0 : 8|8@1+ (1,0) [0|5] "" ROBOT\n'
    )
    bus = {"interface": "fake", "dbc": str(file)}
    with pytest.raises(MosaicError, match="0 must stand still"):
        build(CanSendConfigurer, params={"bus": bus, "message": "Pump", "kinds": {"speed": "velocity"}})
    with pytest.raises(MosaicError, match="is multiplexed"):
        build(CanSendConfigurer, params={"bus": bus, "message": "Cells"})


def test_words_are_commanded_by_their_words() -> None:
    frame = CommandFrame(SAMPLE.by_name["DriveState"], {}, {}, {}, None)
    model = frame.message()
    assert model.model_json_schema()["properties"]["mode"]["enum"] == ["off", "ready", "driving", "fault"]
    command = model.model_validate({"left_mps": 1, "right_mps": 0, "mode": "driving", "faults": 2})
    assert frame.of(command.model_dump()).data.hex() == "e80300000202"


async def test_a_whole_robot_drives_on_the_bus_and_ends_with_the_safe_frame(opened: CanOnSteps) -> None:
    bus = opened.params.model_dump()
    made = connector(CanSendConfigurer, label="drive", params={"bus": bus, **DRIVE}, safety=FAST)
    heard: list[can.Message] = []

    def has(wanted: tuple[float, float, int]) -> bool:
        heard.extend(opened.heard())
        return wanted in said(heard)

    async with joined(made, takes_leases=True) as link:
        await until(lambda: has(SAFE))
        store = link.connection.sendable("drive")
        await store.wait_open()
        await until(lambda: store.send_json(FORWARD) and has((0.5, 0.25, 1)))
    heard.extend(opened.heard())
    assert said(heard)[-1] == SAFE
