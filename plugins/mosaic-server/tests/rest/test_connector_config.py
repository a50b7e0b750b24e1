"""What original dashboards are told of a robot: derived from its catalogue, unless people stored something else."""

from __future__ import annotations

import json
from typing import Any

import pytest

from mosaic_core.words.catalogue import Catalogue, CatalogueEntry
from mosaic_core.words.data_type import Direction, Kind, MosaicDataType
from mosaic_server.connector_config import (
    MAX_CONNECTORS,
    BadConnectorConfig,
    checked_connector_config,
    derived_connector_config,
)

OUR_EXTENSIONS = {"catalogue": 1, "multiPeer": 1, "tickets": 1}
DESCRIBED = json.dumps(
    {"connectors": [{"connectorId": "arm", "dataType": "json-u2r", "widget": "arm-pad"}], "by": "Ada"}
)


def entry(label: str, connector_type: str, data_type: MosaicDataType, **more: Any) -> CatalogueEntry:
    direction = Direction.BOTH if connector_type == "connection-check" else data_type.direction
    return CatalogueEntry(label=label, type=connector_type, data_type=data_type, direction=direction, **more)


def derived(*entries: CatalogueEntry) -> list[dict[str, Any]]:
    described = json.loads(derived_connector_config(Catalogue.of(entries)))
    assert described.keys() == {"connectors"}
    connectors: list[dict[str, Any]] = described["connectors"]
    return connectors


@pytest.mark.parametrize(
    ("announced", "store"),
    [
        (entry("a", "sim-camera", MosaicDataType.MEDIA, kind=Kind.VIDEO), "MediaStreamStore"),
        (entry("a", "battery", MosaicDataType.JSON_R2U), "JsonReceivableStore"),
        (entry("a", "recorder", MosaicDataType.JSON_BI), "JsonReceivableStore"),
        (entry("a", "laser-scan", MosaicDataType.BYTE_R2U, widget="laser-scan"), "JsonReceivableStore"),
        (entry("a", "log", MosaicDataType.STRING_R2U), "StringReceivableStore"),
        (entry("a", "cmd-vel", MosaicDataType.JSON_U2R, safety={"timeout_s": 0.3}), "ThumbstickToTwistStore"),
        (
            entry("a", "acme", MosaicDataType.JSON_U2R, widget="drive-pad", safety={"timeout_s": 1.0}),
            "ThumbstickToTwistStore",
        ),
        (entry("a", "ros2-receiver-geometry-Twist", MosaicDataType.JSON_U2R), "Ros2WasdToTwistStore"),
        (entry("a", "h1-direction", MosaicDataType.JSON_U2R), "H1DirectionSenderStore"),
    ],
)
def test_a_connector_is_shown_by_the_store_of_its_data(announced: CatalogueEntry, store: str) -> None:
    assert derived(announced) == [{"connectorId": "a", "connectorType": store}]


def test_a_connection_check_becomes_its_two_channels() -> None:
    assert derived(entry("check", "connection-check", MosaicDataType.STRING_U2R)) == [
        {"connectorId": "check-receiver", "connectorType": "ConnectionCheckSenderStore"},
        {"connectorId": "check-sender", "connectorType": "ConnectionCheckReceiverStore"},
    ]


def test_a_point_cloud_comes_on_the_channel_that_is_opened_for_it() -> None:
    cloud = entry("cloud", "depth", MosaicDataType.BYTE_R2U, widget="point-cloud")
    assert derived(cloud) == [
        {"connectorId": "cloud", "connectorType": "PointCloudStore", "params": {"parallelNum": 1}}
    ]


@pytest.mark.parametrize(
    "announced",
    [
        entry("a", "microphone", MosaicDataType.MEDIA, kind=Kind.AUDIO),
        entry("a", "arm", MosaicDataType.JSON_U2R),
        entry("a", "say", MosaicDataType.STRING_U2R),
        entry("a", "blob", MosaicDataType.BYTE_R2U),
    ],
)
def test_what_the_original_dashboard_has_no_store_for_is_left_out(announced: CatalogueEntry) -> None:
    assert derived(announced, entry("b", "battery", MosaicDataType.JSON_R2U)) == [
        {"connectorId": "b", "connectorType": "JsonReceivableStore"}
    ]


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("{broken", "no JSON"),
        ("[" * 100_000, "no JSON"),
        ('{"connectors": [], "at": NaN}', "NaN is no JSON"),
        ("[]", "no list of connectors"),
        ('{"connectors": {}}', "no list of connectors"),
        ('{"connectors": [{"connectorId": "a"}, {"connectorType": "x"}]}', r"connectors\[1\] has no connectorId"),
        ('{"connectors": [{"connectorId": ""}]}', r"connectors\[0\]"),
        ('{"connectors": [{"connectorId": 5}]}', r"connectors\[0\]"),
        (json.dumps({"connectors": [{"connectorId": "a"}] * (MAX_CONNECTORS + 1)}), "more than"),
    ],
)
def test_what_describes_no_connectors_is_refused_with_the_reason(text: str, why: str) -> None:
    with pytest.raises(BadConnectorConfig, match=why):
        checked_connector_config(text)


def test_an_operator_describes_a_robot_and_forgets_it_again(server: Any) -> None:
    admin = server.account()
    robot_id, robot_token = server.robot(admin)
    server.member(admin, "bob@example.org")
    bob = server.log_in("bob@example.org")
    path = f"/api/v1/robots/{robot_id}"
    assert _shown(server, path, bob) == (None, False)
    assert server.put(f"{path}/connector-config", bob, {"connectorConfig": DESCRIBED}).json() == {
        "resultCode": 100,
        "resultData": {"message": "description saved"},
    }
    assert _shown(server, path, bob) == (DESCRIBED, True), "as it came, with the keys of others"
    robot = server.connect_robot(robot_id, robot_token, OUR_EXTENSIONS)
    catalogue = Catalogue.of([entry("front", "camera", MosaicDataType.MEDIA, kind=Kind.VIDEO)])
    robot.send("catalogue.announce", {"catalogue": catalogue.wire()})
    robot.status(0)
    _until_announced(server, path, bob)
    assert _shown(server, path, bob) == (DESCRIBED, True), "what a person stored wins"
    server.put(f"{path}/connector-config", bob, {"connectorConfig": None})
    assert _shown(server, path, bob) == (
        '{"connectors":[{"connectorId":"front","connectorType":"MediaStreamStore"}]}',
        False,
    )


def test_observers_and_strangers_describe_nothing(server: Any) -> None:
    admin = server.account()
    robot_id, _ = server.robot(admin)
    bob = server.member(admin, "bob@example.org")
    token = server.log_in()
    server.put(f"/api/v1/robots/{robot_id}/grants/{bob.id}", token, {"role": "observer"})
    server.account("eve@example.org")
    path, body = f"/api/v1/robots/{robot_id}/connector-config", {"connectorConfig": DESCRIBED}
    refused = server.put(path, server.log_in("bob@example.org"), body)
    assert (refused.status_code, refused.json()["resultCode"]) == (403, "ACCESS_DENIED")
    assert server.put(path, server.log_in("eve@example.org"), body).json()["resultCode"] == "ROBOT_NOT_FOUND"
    assert server.http.put(path, json=body).status_code == 401


@pytest.mark.parametrize(
    "body", [{}, {"connectorConfig": 5}, {"connectorConfig": "{}"}, {"connectorConfig": "x" * 500_001}]
)
def test_nonsense_is_not_stored(server: Any, body: dict[str, Any]) -> None:
    robot_id, _ = server.robot(server.account())
    token = server.log_in()
    refused = server.put(f"/api/v1/robots/{robot_id}/connector-config", token, body)
    assert (refused.status_code, refused.json()["resultCode"]) == (400, "INVALID_FORMAT")
    assert _shown(server, f"/api/v1/robots/{robot_id}", token) == (None, False)


def _shown(server: Any, path: str, token: str) -> tuple[str | None, bool]:
    robot = server.get(path, token).json()["resultData"]
    return robot["connectorConfig"], robot["connectorConfigIsStored"]


def _until_announced(server: Any, path: str, token: str) -> None:
    """The robot's status, sent after its catalogue, tells that the catalogue has arrived."""
    user = server.connect_operator(token)
    user.send("status.subscribe", {"robotIds": [path.rsplit("/", 1)[1]]})
    while user.expect("status.update")["status"] != 0:
        pass
