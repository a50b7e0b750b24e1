"""Every REST route that the original page calls, on our server, with the documents' payloads in both directions."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any
from uuid import UUID

import pytest

pytestmark = [pytest.mark.webrtc, pytest.mark.timeout(60)]

USER = {"id": str, "email": str, "isActive": bool, "isOrganizationAdmin": bool, "fullName": str}
STAMPS = ("createdAt", "updatedAt")
ROBOT = {"id": str, "name": str, "description": str, "status": int, "authType": int, "organizationId": str}
MAP = {"id": str, "name": str, "pgmFilePath": str, "yamlFilePath": str}
WIDGETS = {
    "widgets": [
        {
            "id": "w1",
            "type": "JsonViewer",
            "position": {"x": 0, "y": 0, "w": 3, "h": 2},
            "connectors": [{"robotId": "7d1c2f6e-0b52-4c1e-9a53-2f6f1f0c9b11", "connectorId": "pose"}],
            "params": {"cumulative": True},
        }
    ]
}
MAP_YAML = "image: hall.pgm\nmode: trinary\nresolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\n"
PGM = b"P5\n4 2\n255\n" + bytes(range(8))


def fits(found: dict[str, Any], wanted: dict[str, type], stamps: tuple[str, ...] = ()) -> dict[str, Any]:
    """Every documented key with its type; further keys are nobody's business."""
    assert set(wanted) | set(stamps) <= set(found), f"{sorted(found)} lack {sorted(set(wanted) - set(found))}"
    for key, kind in wanted.items():
        assert type(found[key]) is kind, f"{key}: {found[key]!r} is no {kind.__name__}"
    assert all(isinstance(found[key], str | int | float) for key in stamps)
    if "id" in wanted:
        UUID(found["id"])
    return found


def listed(found: Any) -> list[dict[str, Any]]:
    assert set(found) == {"data", "count"}
    assert found["count"] >= len(found["data"])
    return list(found["data"])


async def told(rest: Any, method: str, path: str, **body: Any) -> None:
    """A mutation, whose result is a message; the page reads nothing else of it."""
    done = await rest(method, path, **body)
    assert isinstance(done["message"], str)


@pytest.fixture
def proves(pair: Any, rest_of: Any) -> Callable[[str, Any], None]:
    """`proves(what, calls)`: `calls(rest)` runs with the routes of a signed-in page."""

    def run(what: str, calls: Any) -> None:
        pair("our server", "original page's REST calls", what)
        rest_of(calls)

    return run


def test_own_account(proves: Any, seed: Any) -> None:
    async def calls(rest: Any) -> None:
        me = fits(await rest("GET", "/api/v1/users/me"), USER, STAMPS)
        assert me["email"] == seed.email
        await told(rest, "PUT", "/api/v1/users/me", fullName="Ada Byron")
        assert (await rest("GET", "/api/v1/users/me"))["fullName"] == "Ada Byron"
        await told(rest, "PUT", "/api/v1/users/me/password", currentPassword=seed.password, newPassword="another-one-1")
        await rest.log_in(seed.email, "another-one-1")
        await told(rest, "PUT", "/api/v1/users/me/password", currentPassword="another-one-1", newPassword=seed.password)
        await rest.log_in(seed.email, seed.password)
        done = await rest("POST", "/api/v1/account/login/access-token", username=seed.email, password=seed.password)
        assert set(done) >= {"accessToken", "existingConnection"}
        assert done["existingConnection"] is False
        await told(rest, "POST", "/api/v1/account/disconnect")

    proves("log-in, own name and password", calls)


def test_users_of_the_organization(proves: Any) -> None:
    async def calls(rest: Any) -> None:
        users = "/api/v1/organization/users"
        new = {"email": "bob@example.org", "password": "long-enough-1", "fullName": "Bob", "isOrganizationAdmin": False}
        await told(rest, "POST", users, **new)
        bob = next(it for it in listed(await rest("GET", f"{users}?skip=0&limit=100")) if it["fullName"] == "Bob")
        fits(bob, USER, STAMPS)
        await told(rest, "PUT", users, id=bob["id"], fullName="Robert", isActive=True)
        names = [it["fullName"] for it in listed(await rest("GET", f"{users}?skip=0&limit=100"))]
        assert "Robert" in names
        await told(rest, "DELETE", users, id=bob["id"])
        assert "Robert" not in [it["fullName"] for it in listed(await rest("GET", f"{users}?skip=0&limit=100"))]

    proves("users of the organization: list, add, change, remove", calls)


def test_robots_and_their_tokens(proves: Any) -> None:
    async def calls(rest: Any) -> None:
        robot_id, token = await rest.add_robot("Routes")
        assert token
        robot = fits(await rest.robot(robot_id), ROBOT)
        assert robot["status"] in range(7)
        assert "connectorConfig" in robot
        config = json.dumps(
            {"connectors": [{"connectorId": "p", "connectorType": "JsonReceivableStore", "params": {}}]}
        )
        words = {"name": "Routes 2", "description": "d", "authType": 1}
        await told(rest, "PUT", f"/api/v1/robots/{robot_id}", **words, connectorConfig=config)
        robot = await rest.robot(robot_id)
        assert (robot["name"], json.loads(robot["connectorConfig"])) == ("Routes 2", json.loads(config))
        newer = await rest("POST", f"/api/v1/robot-auth/simple-token/{robot_id}")
        assert isinstance(newer["token"], str)
        await told(rest, "DELETE", f"/api/v1/robots/{robot_id}")
        assert robot_id not in [it["id"] for it in await rest.robots()]

    proves("robots: list, add, describe by `connectorConfig`, both routes of tokens, remove", calls)


def test_tabs_and_what_is_on_them(proves: Any) -> None:
    async def calls(rest: Any) -> None:
        tabs = "/api/v1/dashboard/tabs"
        assert all(set(tab) >= {"id", "name"} for tab in await rest("GET", tabs))
        await told(rest, "POST", tabs, name="Hall")
        tab_id = next(tab["id"] for tab in await rest("GET", tabs) if tab["name"] == "Hall")
        await told(rest, "PUT", f"{tabs}/{tab_id}", name="Great hall")
        await told(rest, "PUT", f"{tabs}/{tab_id}/configs", tabConfig=json.dumps(WIDGETS))
        tab = fits(await rest("GET", f"{tabs}/{tab_id}"), {"id": str, "name": str, "widgets": str})
        assert tab["name"] == "Great hall"
        assert json.loads(tab["widgets"]) == WIDGETS
        await told(rest, "DELETE", f"{tabs}/{tab_id}")
        assert tab_id not in [tab["id"] for tab in await rest("GET", tabs)]

    proves("tabs: list, add, rename, keep widgets, remove", calls)


def test_occupancy_maps(proves: Any) -> None:
    async def calls(rest: Any) -> None:
        maps = "/api/v1/occupancy_map"
        files = {"pgm_file": ("hall.pgm", PGM), "yaml_file": ("hall.yaml", MAP_YAML)}
        answer = await rest.http.post(maps, data={"name": "Hall"}, files=files)
        assert answer.status_code == 200, answer.text
        assert isinstance(answer.json()["resultData"]["message"], str)
        hall = next(it for it in listed(await rest("GET", f"{maps}?skip=0&limit=100")) if it["name"] == "Hall")
        fits(hall, MAP, STAMPS)
        one = f"{maps}/{hall['id']}"
        fits(await rest("GET", one), MAP, STAMPS)
        pgm, yaml, whole = [await rest.http.get(f"{one}/{what}") for what in ("pgm", "yaml", "download")]
        assert (pgm.content, pgm.headers["content-type"]) == (PGM, "application/octet-stream")
        assert "resolution: 0.05" in yaml.text
        assert yaml.headers["content-type"].startswith("application/x-yaml")
        assert whole.content.startswith(b"PK")
        assert whole.headers["content-type"] == "application/zip"
        await told(rest, "DELETE", one)
        assert (await rest.http.get(one)).status_code == 404

    proves("occupancy maps: upload, list, files, remove", calls)


def test_ice_servers_and_errors(proves: Any) -> None:
    async def calls(rest: Any) -> None:
        for path in ("/api/v1/webrtc/ice-servers", "/api/v1/ice-servers"):
            answer = await rest.http.get(path)
            assert answer.status_code == 200
            assert isinstance(answer.json(), list), "a bare array, no envelope"
        nobody = "00000000-0000-4000-8000-000000000000"
        answer = await rest.http.post("/api/v1/webrtc/connection", json={"robotIds": [nobody]})
        assert answer.status_code == 404
        assert answer.json().items() >= {"resultCode": "ROBOT_NOT_FOUND", "resultData": None}.items()
        robot_id, _ = await rest.add_robot("Absent")
        answer = await rest.http.post("/api/v1/webrtc/connection", json={"robotIds": [robot_id]})
        absent = ("ROBOT_NOT_READY_TO_CONNECT", "ROBOT_WS_SESSION_NOT_EXIST", "USER_WS_SESSION_NOT_EXIST")
        assert answer.json()["resultCode"] in absent

    proves("ICE servers as a bare array; errors by their names", calls)
