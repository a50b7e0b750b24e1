"""Signals by a DBC file: what is said arrives with its unit, what is old does not, and garbage is counted."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import can
import pytest
from cantools.database.can import Database
from hypothesis import given
from hypothesis import strategies as st
from support.devices.can_steps import BATTERY_ID, COMMAND_ID, STATE_ID, CanOnSteps, losses

from mosaic_can.databases import CanDatabase
from mosaic_can.signal_fields import field_name
from mosaic_can.signal_reader import SignalReader
from mosaic_can.signals import CanSignalsConfigurer
from mosaic_core.contract.params import Message
from mosaic_core.testing import collect, connector, fake_host, joined
from mosaic_core.words.errors import DeviceGone, MosaicError

SAMPLE = CanDatabase(["sample"])
MULTIPLEXED = """VERSION ""
BO_ 768 Cells: 3 BASE
 SG_ page M : 0|8@1+ (1,0) [0|1] "" ROBOT
 SG_ first_v m0 : 8|16@1+ (0.001,0) [0|5] "V" ROBOT
 SG_ second_v m1 : 8|16@1+ (0.001,0) [0|5] "V" ROBOT
"""


def can_database(text: str) -> Database:
    database = Database()
    database.add_dbc_string(text)
    return database


def state(**values: Any) -> tuple[int, bytes]:
    said = {"left_mps": 0.5, "right_mps": -0.25, "mode": "driving", "faults": 3, **values}
    return STATE_ID, SAMPLE.by_name["DriveState"].encode(said)


def battery() -> tuple[int, bytes]:
    said = {"voltage_v": 24.5, "current_a": -3.0, "charge_percent": 87.5}
    return BATTERY_ID, SAMPLE.by_name["BatteryState"].encode(said)


def test_the_newest_values_are_told_by_name_and_what_was_never_heard_is_null(steps: CanOnSteps) -> None:
    handler = steps.build(CanSignalsConfigurer)
    steps.says(state(left_mps=0.1), state(), battery())
    (told,) = collect(handler, 1)
    assert told == {
        "DriveCommand": None,
        "DriveState": {"left_mps": 0.5, "right_mps": -0.25, "mode": "driving", "faults": 3},
        "BatteryState": {"voltage_v": 24.5, "current_a": -3.0, "charge_percent": 87.5},
    }
    assert losses(handler) == {}


def test_the_catalogue_has_units_words_and_types(steps: CanOnSteps) -> None:
    (handler,) = [steps.build(CanSignalsConfigurer, messages=["DriveState"])]
    from mosaic_core.contract.handler import message_type_of

    model = message_type_of(type(handler))
    assert issubclass(model, Message)
    fields = model.model_json_schema()["$defs"]["DriveState"]["properties"]
    assert fields["left_mps"]["unit"] == "m/s"
    assert {one["type"] for one in fields["faults"]["anyOf"]} == {"integer", "null"}
    assert {one["type"] for one in fields["mode"]["anyOf"]} == {"string", "null"}
    assert "off, ready, driving, fault" in fields["mode"]["description"]
    assert "One bit for each fault." in fields["faults"]["description"]


def test_what_is_old_is_not_told_any_more(steps: CanOnSteps) -> None:
    handler = steps.build(CanSignalsConfigurer, stale_s=1.0, rate_hz=4)
    steps.says(state())
    assert len(collect(handler, within_s=3.0)) == 5  # at 0, 0.25, … 1.0 s


def test_unknown_ids_wrong_lengths_and_remote_frames_are_refused_and_counted(steps: CanOnSteps) -> None:
    handler = steps.build(CanSignalsConfigurer)
    frame_id, data = state()
    steps.says((0x7FF, b""), (frame_id, data[:-1]), (frame_id, data + b"\0"), (BATTERY_ID, b""), (frame_id, data))
    steps.says(can.Message(arbitration_id=frame_id, is_extended_id=False, is_remote_frame=True))
    steps.says(can.Message(arbitration_id=frame_id, is_extended_id=True, data=data))
    (told,) = collect(handler, 1)
    assert told["DriveState"]["faults"] == 3
    assert losses(handler) == {"refused": 6}


def test_with_messages_named_everything_else_is_somebody_elses(steps: CanOnSteps) -> None:
    handler = steps.build(CanSignalsConfigurer, messages=["BatteryState"])
    steps.says((0x7FF, b""), state(), battery())
    (told,) = collect(handler, 1)
    assert list(told) == ["BatteryState"]
    assert losses(handler) == {}


def test_a_value_without_a_word_is_told_as_its_number(steps: CanOnSteps) -> None:
    handler = steps.build(CanSignalsConfigurer, messages=["DriveState"])
    steps.says((STATE_ID, bytes([0, 0, 0, 0, 7, 0])))
    (told,) = collect(handler, 1)
    assert told["DriveState"]["mode"] == "7"


def test_a_bus_that_is_away_for_thirty_seconds_is_gone_and_its_return_tells_nothing_of_before(
    steps: CanOnSteps,
) -> None:
    handler = steps.build(CanSignalsConfigurer, stale_s=60)
    steps.says(state(faults=7), battery())
    steps.is_plugged_in = False
    assert not steps.bus.step(0.0)
    with pytest.raises(DeviceGone, match="is lost"):
        collect(handler, 1)
    steps.bus.close()
    for _ in range(6):  # as the robot tries again
        fake_host(handler).clock.advance(5.0)
        with pytest.raises(DeviceGone, match="can't be opened"):
            steps.bus.open()
        with pytest.raises(DeviceGone, match="Network is down"):
            collect(handler, 1)
    steps.is_plugged_in = True
    steps.bus.open()
    steps.says(state(faults=8))
    (told,) = collect(handler, 1)
    assert (told["DriveState"]["faults"], told["BatteryState"]) == (8, None)


def test_a_flood_costs_one_message_per_period(steps: CanOnSteps) -> None:
    handler = steps.build(CanSignalsConfigurer, rate_hz=10)
    steps.says(*[state(faults=number % 256) for number in range(500)])
    assert len(collect(handler, within_s=0.99)) == 10
    assert {one["DriveState"]["faults"] for one in _sent(handler)} == {499 % 256}


def _sent(handler: Any) -> list[Any]:
    import json

    return [json.loads(one.payload) for one in fake_host(handler).sent]


def test_the_pages_of_a_multiplexed_message_fill_up_one_after_the_other(tmp_path: Path) -> None:
    file = tmp_path / "cells.dbc"
    file.write_text(MULTIPLEXED)
    steps = CanOnSteps(str(file))
    steps.bus.open()
    handler = steps.build(CanSignalsConfigurer)
    steps.says((768, bytes([0, 0xE8, 0x03])), (768, bytes([1, 0xD0, 0x07])), (768, bytes([9, 0, 0])))
    (told,) = collect(handler, 1)
    assert told == {"Cells": {"page": 1, "first_v": 1.0, "second_v": 2.0}}
    assert losses(handler) == {"refused": 1}  # there is no page 9


def test_a_frame_of_can_fd_is_filled_up_to_a_length_that_it_has() -> None:
    text = 'VERSION ""\nBO_ 16 Long: 10 BASE\n SG_ last : 72|8@1+ (1,0) [0|0] "" ROBOT\n'
    described = can_database(text).messages[0]
    reader = SignalReader({"Long": described}, 1.0)
    frames = [can.Message(arbitration_id=16, is_extended_id=False, is_fd=True, data=bytes(9) + b"\7" + bytes(more))
        for more in (0, 1, 2)]  # fmt: skip
    assert len(list(reader.feed(frames, 0.0))) == 2
    assert reader.snapshot(0.0) == {"Long": {"last": 7}}


@given(st.lists(st.tuples(st.sampled_from([STATE_ID, BATTERY_ID, COMMAND_ID, 1]), st.binary(max_size=8)), max_size=20))
def test_every_frame_is_read_refused_or_replaced_by_a_newer_one(said: list[tuple[int, bytes]]) -> None:
    reader = SignalReader(SAMPLE.by_name, stale_s=1.0)
    lengths = {one.frame_id: one.length for one in SAMPLE.by_name.values()}
    frames = [can.Message(arbitration_id=key, data=data, is_extended_id=False) for key, data in said]
    refused = list(reader.feed(frames, 5.0))
    assert len(refused) == sum(lengths.get(key) != len(data) for key, data in said)
    heard = {key for key, data in said if lengths.get(key) == len(data)}
    snapshot = reader.snapshot(5.5)
    assert {name for name, one in snapshot.items() if one} == {SAMPLE.by_key[key, False].name for key in heard}
    assert set(reader.snapshot(6.1).values()) == {None}


@pytest.mark.parametrize(("name", "field"), [("speed", "speed"), ("_x", "x"), ("copy", "copy_"), ("__", "unnamed")])
def test_names_that_no_field_can_have_are_changed_a_little(name: str, field: str) -> None:
    assert field_name(name) == field


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("no dbc at all", "can't be read"),
        (MULTIPLEXED.replace("first_v", "copy").replace("second_v", "copy_"), "can't be told apart"),
    ],
)
def test_a_file_that_cannot_be_used_is_told(tmp_path: Path, text: str, said: str) -> None:
    file = tmp_path / "wrong.dbc"
    file.write_text(text)
    with pytest.raises(MosaicError, match=said):
        CanOnSteps(str(file)).build(CanSignalsConfigurer)


@pytest.mark.parametrize(
    ("files", "said"),
    [(["nowhere.dbc"], "nowhere.dbc can't be read"), (["sample", "sample"], "a second time")],
)
def test_files_that_are_not_there_or_say_things_twice_are_told(files: list[str], said: str) -> None:
    with pytest.raises(MosaicError, match=said):
        CanDatabase(files)


def test_a_message_that_the_file_does_not_have_is_told_with_the_nearest_one(steps: CanOnSteps) -> None:
    with pytest.raises(MosaicError, match="did you mean 'DriveState'"):
        steps.build(CanSignalsConfigurer, messages=["DriveStat"])
    with pytest.raises(MosaicError, match="Name a DBC file"):
        CanDatabase([]).named([])


def test_what_cantools_reads_is_what_it_wrote() -> None:
    """The sample is a file that its own writer would write again."""
    database = can_database(SAMPLE_TEXT)
    again = can_database(database.as_dbc_string())
    assert [one.name for one in again.messages] == list(SAMPLE.by_name)


SAMPLE_TEXT = (Path(__file__).parent.parent / "mosaic_can" / "sample.dbc").read_text()


async def test_an_operator_of_a_whole_robot_reads_the_bus_that_is_made_up() -> None:
    params = {"bus": {"interface": "fake", "dbc": "sample"}}
    async with joined(connector(CanSignalsConfigurer, label="base", params=params)) as link:
        told = (await link.connection.receivable("base").next_message()).json()
        assert set(told) == {"DriveCommand", "DriveState", "BatteryState"}
