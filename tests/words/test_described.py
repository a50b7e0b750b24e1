"""What people wrote down of a robot that announces nothing is read tolerantly."""

from __future__ import annotations

import json

import pytest

from mosaic_core.words.data_type import MosaicDataType
from mosaic_core.words.described import (
    MOST_CHANNELS,
    DescribedConnector,
    described_entry,
    drive_of,
    read_connector_config,
)


@pytest.mark.parametrize("text", [None, "", "null", "[]", "3", "{", "{}", '{"connectors": 3}', '{"connectors": [3]}'])
def test_a_config_that_says_nothing_describes_nothing(text: str | None) -> None:
    assert read_connector_config(text) == ()


def test_what_cannot_be_read_takes_nothing_from_the_rest() -> None:
    good = {"connectorId": "odom", "connectorType": "JsonReceivableStore", "params": {"parallelNum": None}}
    rows = [{"connectorId": ""}, {"connectorId": "x", "dataType": "json-sideways"}, good]
    assert [one.connector_id for one in read_connector_config(json.dumps({"connectors": rows}))] == ["odom"]


@pytest.mark.parametrize(
    ("params", "channels"),
    [
        ({"parallelNum": 2}, ["c-0", "c-1"]),
        ({"parallel_num": "2"}, ["c-0", "c-1"]),
        ({"parallel_stream": 2}, ["c-0", "c-1"]),
        ({}, ["c-0"]),
        ({"parallelNum": -3}, ["c-0"]),
        ({"parallelNum": "many"}, ["c-0"]),
    ],
)
def test_a_point_cloud_of_a_robot_has_as_many_numbered_channels_as_it_says(
    params: dict[str, object], channels: list[str]
) -> None:
    entry = described_entry(
        DescribedConnector(connector_id="c", connector_type="ros2-sender-sensor-PointCloud2", params=params)
    )
    assert entry is not None
    assert [channel.label for channel in entry.channels] == channels


def test_a_slip_of_the_keyboard_opens_no_thousand_channels() -> None:
    entry = described_entry(
        DescribedConnector(connector_id="c", connector_type="PointCloudStore", params={"parallelNum": 100_000})
    )
    assert entry is not None
    assert len(entry.channels) == MOST_CHANNELS


@pytest.mark.parametrize(
    ("connector", "drive"),
    [
        (DescribedConnector(connector_id="d", connector_type="ros2-receiver-geometry-TwistStamped"), "twist"),
        (DescribedConnector(connector_id="d", connector_type="turtlebot-receiver-teleop"), "teleop"),
        (DescribedConnector(connector_id="d", connector_type="H1DirectionSenderStore"), "h1-direction"),
        (DescribedConnector(connector_id="d", data_type=MosaicDataType.JSON_U2R, widget="drive-pad"), "twist"),
        (DescribedConnector(connector_id="d", data_type=MosaicDataType.JSON_U2R), None),
        (DescribedConnector(connector_id="d", connector_type="JsonReceivableStore"), None),
        (
            DescribedConnector(
                connector_id="d", connector_type="Ros2WasdToTwistStore", data_type=MosaicDataType.JSON_R2U
            ),
            None,
        ),
    ],
)
def test_only_what_is_known_to_take_velocities_can_be_driven(connector: DescribedConnector, drive: str | None) -> None:
    entry = described_entry(connector)
    assert entry is not None
    command = drive_of(entry)
    assert (command.name if command is not None else None) == drive
