"""Every REST route that an original dashboard uses, with the bodies that it sends and the fields that it reads.

Written from the description of the original's routes and DTOs: requests carry exactly its keys, and of each answer the
original's fields must be there with their types. Keys of ours beside them are named, and there are no others.
"""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Callable
from dataclasses import replace
from typing import Any
from uuid import UUID, uuid4

import httpx
import pytest

from mosaic_core.words.catalogue import Catalogue, CatalogueEntry
from mosaic_core.words.data_type import Direction, MosaicDataType
from mosaic_core.words.ice import IceServer
from mosaic_server.storage.ice_servers import add_ice_server
from mosaic_server.storage.robots import keep_catalogue

NOBODY = "00000000-0000-4000-8000-000000000000"
PASSWORD = "correct horse battery"  # noqa: S105 - of throw-away accounts
PGM = b"P5\n# a room\n4 2\n255\n" + bytes(range(8))
YAML = (
    b"image: room.pgm\nresolution: 0.05\norigin: [-1.0, -2.0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.2\n"
)


def uuid(value: Any) -> bool:
    return isinstance(value, str) and str(UUID(value)) == value


def text(value: Any) -> bool:
    return isinstance(value, str)


def truth(value: Any) -> bool:
    return isinstance(value, bool)


def number(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def text_or_null(value: Any) -> bool:
    return value is None or text(value)


Shape = dict[str, Callable[[Any], bool]]
USER: Shape = {
    "id": uuid, "email": text, "isActive": truth, "isOrganizationAdmin": truth, "fullName": text,
    "createdAt": text, "updatedAt": text,
}  # fmt: skip
ROBOT: Shape = {
    "id": uuid, "name": text, "description": text, "status": number, "authType": number, "organizationId": uuid,
    "connectorConfig": text_or_null,
}  # fmt: skip
MAP: Shape = {
    "id": uuid, "name": text, "pgmFilePath": text, "yamlFilePath": text, "createdAt": text, "updatedAt": text,
}  # fmt: skip
OURS = {"isProgram", "isOnline", "myRole", "connectorConfigIsStored"}


def must_have(shape: Shape, value: dict[str, Any], ours: set[str] = OURS) -> None:
    assert shape.keys() <= value.keys() <= shape.keys() | ours, value.keys()
    for key, fits in shape.items():
        assert fits(value[key]), (key, value[key])


def result(answer: httpx.Response) -> Any:
    assert answer.status_code == 200, answer.text
    body = answer.json()
    assert body.keys() == {"resultCode", "resultData"}
    assert body["resultCode"] == 100
    return body["resultData"]


def message(answer: httpx.Response) -> None:
    """What the original answers to every change."""
    must_have({"message": text}, result(answer), {"id"})


def page(answer: httpx.Response, shape: Shape) -> list[dict[str, Any]]:
    data = result(answer)
    assert data.keys() == {"data", "count"}
    assert data["count"] == len(data["data"])
    for one in data["data"]:
        must_have(shape, one)
    rows: list[dict[str, Any]] = data["data"]
    return rows


def refusal(answer: httpx.Response) -> tuple[int, str]:
    body = answer.json()
    assert {"resultCode", "resultData"} <= body.keys()
    assert body["resultData"] is None
    return answer.status_code, body["resultCode"]


def delete(server: Any, path: str, token: str, body: Any) -> httpx.Response:
    headers = {"Authorization": f"Bearer {token}"}
    answer: httpx.Response = server.http.request("DELETE", path, headers=headers, json=body)
    return answer


# --- accounts


def test_a_person_signs_up_logs_in_and_finds_the_first_tab(server: Any) -> None:
    signup = {"email": "new@example.org", "password": PASSWORD, "fullName": "New"}
    message(server.http.post("/api/v1/account/signup", json=signup))
    login = {"username": "new@example.org", "password": PASSWORD}
    access = result(server.http.post("/api/v1/account/login/access-token", json=login))
    must_have({"accessToken": text, "existingConnection": truth}, access)
    token = access["accessToken"]
    (tab,) = result(server.get("/api/v1/dashboard/tabs", token))
    must_have({"id": uuid, "name": text}, tab)
    assert tab["name"] == "Default"
    shown = result(server.get(f"/api/v1/dashboard/tabs/{tab['id']}", token))
    assert shown == {"id": tab["id"], "name": "Default", "widgets": '{"widgets":[]}'}
    message(server.post("/api/v1/account/disconnect", token))


def test_a_server_that_takes_no_sign_ups_says_so(settings: Any, start_server: Callable[..., Any]) -> None:
    with start_server(replace(settings, allow_signup=False)) as closed:
        signup = {"email": "new@example.org", "password": PASSWORD, "fullName": "New"}
        answer = closed.http.post("/api/v1/account/signup", json=signup)
        assert refusal(answer) == (403, "ACCESS_DENIED")
        assert "no sign-ups" in answer.json()["message"]


def test_a_member_logs_in_by_organization(server: Any) -> None:
    admin = server.account()
    server.member(admin, "bob@example.org")

    def log_in(name: str, **more: str) -> httpx.Response:
        login = {"username": "bob@example.org", "password": PASSWORD, "organizationName": name} | more
        answer: httpx.Response = server.http.post("/api/v1/account/login/organization/access-token", json=login)
        return answer

    access = result(log_in("ada@example.org"))
    must_have({"accessToken": text, "existingConnection": truth}, access)
    must_have(USER, result(server.get("/api/v1/users/me", access["accessToken"])))
    assert refusal(log_in("bob@example.org")) == (401, "INVALID_PASSWORD")
    assert log_in("nobody").json() == log_in("ada@example.org", password="wrong").json(), "they tell nothing apart"  # noqa: S106


def test_the_own_account_is_shown_and_changed(server: Any) -> None:
    server.account()
    token = server.log_in()
    must_have(USER, result(server.get("/api/v1/users/me", token)))
    message(server.put("/api/v1/users/me", token, {"fullName": "Countess"}))
    change = {"currentPassword": PASSWORD, "newPassword": "another password"}
    message(server.put("/api/v1/users/me/password", token, change))


def test_an_administrator_keeps_the_accounts_of_the_organization(server: Any) -> None:
    admin = server.account()
    token = server.log_in()
    new = {"email": "bob@example.org", "password": PASSWORD, "fullName": "Bob", "isOrganizationAdmin": False}
    message(server.post("/api/v1/organization/users", token, new))
    people = page(server.get("/api/v1/organization/users?skip=0&limit=100", token), USER)
    assert [one["email"] for one in people] == ["ada@example.org", "bob@example.org"]
    bob = people[1]["id"]
    change = {"id": bob, "password": "a new password", "isActive": True, "isOrganizationAdmin": True, "fullName": "Rob"}
    message(server.put("/api/v1/organization/users", token, change))
    login = {"username": "bob@example.org", "password": "a new password"}
    rob = result(server.http.post("/api/v1/account/login/access-token", json=login))["accessToken"]
    shown = result(server.get("/api/v1/users/me", rob))
    assert (shown["fullName"], shown["isOrganizationAdmin"]) == ("Rob", True)
    message(server.put("/api/v1/organization/users", token, {"id": bob, "password": "", "isActive": False}))
    assert server.get("/api/v1/users/me", rob).status_code == 401
    message(delete(server, "/api/v1/organization/users", token, {"id": bob}))
    assert refusal(delete(server, "/api/v1/organization/users", token, {"id": bob})) == (404, "USER_NOT_FOUND")
    assert refusal(delete(server, "/api/v1/organization/users", token, {"id": admin.id})) == (
        403, "CANNOT_DELETE_YOURSELF",
    )  # fmt: skip


def test_of_the_own_account_an_administrator_changes_the_name_alone(server: Any) -> None:
    admin = server.account()
    token = server.log_in()
    whole_form = {"id": admin.id, "isActive": True, "isOrganizationAdmin": True, "fullName": "Countess"}
    message(server.put("/api/v1/organization/users", token, whole_form))
    for more in ({"isActive": False}, {"isOrganizationAdmin": False}, {"password": "another password"}):
        answer = server.put("/api/v1/organization/users", token, whole_form | more)
        assert refusal(answer) == (403, "ACCESS_DENIED")


def test_accounts_are_the_administrators_business(server: Any) -> None:
    admin = server.account()
    bob = server.member(admin, "bob@example.org")
    eve = server.account("eve@example.org")
    token, stranger = server.log_in("bob@example.org"), server.log_in("eve@example.org")
    path = "/api/v1/organization/users"
    assert refusal(server.get(path, token)) == (403, "ACCESS_DENIED")
    assert refusal(server.put(path, token, {"id": bob.id, "isOrganizationAdmin": True})) == (403, "ACCESS_DENIED")
    assert refusal(server.put(path, stranger, {"id": bob.id, "fullName": "x"})) == (404, "USER_NOT_FOUND")
    assert [one["id"] for one in page(server.get(path, stranger), USER)] == [eve.id]


# --- robots


def test_robots_are_made_listed_changed_and_removed(server: Any) -> None:
    server.account()
    token = server.log_in()
    new = {"name": "rover", "description": "d", "status": 5, "authType": 1}
    message(server.post("/api/v1/robots", token, new))
    (robot,) = page(server.get("/api/v1/robots?skip=0&limit=100", token), ROBOT)
    path = f"/api/v1/robots/{robot['id']}"
    must_have(ROBOT, result(server.get(path, token)))
    message(server.put(path, token, new | {"name": "other", "connectorConfig": '{"connectors":[]}'}))
    assert result(server.get(path, token))["connectorConfig"] == '{"connectors":[]}'
    for answer in (
        server.post("/api/v1/robots/auth/simple-token", token, {"robotId": robot["id"]}),
        server.post(f"/api/v1/robot-auth/simple-token/{robot['id']}", token),
    ):
        must_have({"token": text}, result(answer))
    message(server.delete(path, token))
    assert refusal(server.get(path, token)) == (404, "ROBOT_NOT_FOUND")


def test_the_newer_address_for_tokens_renews_them_and_needs_a_robot_that_has_one(server: Any) -> None:
    admin = server.account()
    robot_id, old = server.robot(admin)
    token = server.log_in()
    robot = server.connect_robot(robot_id, old)
    new = result(server.post(f"/api/v1/robot-auth/simple-token/{robot_id}", token))["token"]
    assert robot.close_code() == 4401
    server.connect_robot(robot_id, new)
    server.put(f"/api/v1/robots/{robot_id}", token, {"authType": 0})
    answer = server.post(f"/api/v1/robot-auth/simple-token/{robot_id}", token)
    assert refusal(answer) == (400, "INVALID_ROBOT_AUTH_TYPE")
    server.member(admin, "bob@example.org")
    answer = server.post(f"/api/v1/robot-auth/simple-token/{robot_id}", server.log_in("bob@example.org"))
    assert refusal(answer) == (403, "ACCESS_DENIED")


def test_a_form_that_sends_back_what_was_derived_does_not_freeze_it(
    server: Any, settings: Any, start_server: Callable[..., Any], tmp_path: Any
) -> None:
    other = replace(settings, data_dir=tmp_path / "other")
    with start_server(other) as first:
        robot_id, _ = first.robot(first.account())
    battery = CatalogueEntry(
        label="b", type="battery", data_type=MosaicDataType.JSON_R2U, direction=Direction.TO_OPERATOR
    )
    with start_server(other) as second:
        second.work(keep_catalogue, robot_id, json.dumps(Catalogue.of([battery]).wire()))
    with start_server(other) as third:
        token, path = third.log_in(), f"/api/v1/robots/{robot_id}"
        robot = result(third.get(path, token))
        assert json.loads(robot["connectorConfig"])["connectors"][0]["connectorId"] == "b"
        form = {key: robot[key] for key in ("name", "description", "status", "authType", "connectorConfig")}
        message(third.put(path, token, form | {"name": "renamed"}))
        shown = result(third.get(path, token))
        assert (shown["name"], shown["connectorConfigIsStored"]) == ("renamed", False)


# --- tabs


def test_tabs_are_made_arranged_renamed_and_removed(server: Any) -> None:
    server.account()
    token = server.log_in()
    message(server.post("/api/v1/dashboard/tabs", token, {"name": "Second"}))
    tabs = result(server.get("/api/v1/dashboard/tabs", token))
    for tab in tabs:
        assert tab.keys() == {"id", "name"}
    assert [tab["name"] for tab in tabs] == ["Default", "Second"]
    path = f"/api/v1/dashboard/tabs/{tabs[1]['id']}"
    assert result(server.get(path, token)) == tabs[1] | {"widgets": '{"widgets":[]}'}
    position = {"x": 0, "y": 0, "w": 4, "h": 3}
    connector = {"robotId": str(uuid4()), "connectorId": "front"}
    widget = {"id": "w1", "type": "MediaViewer", "position": position, "connectors": [connector]}
    tab_config = json.dumps({"widgets": [widget]}, indent=1)
    message(server.put(f"{path}/configs", token, {"tabConfig": tab_config}))
    message(server.put(path, token, {"name": "Renamed"}))
    assert result(server.get(path, token)) == {"id": tabs[1]["id"], "name": "Renamed", "widgets": tab_config}
    message(server.delete(path, token))
    for answer in (
        server.get(path, token),
        server.put(path, token, {"name": "x"}),
        server.put(f"{path}/configs", token, {"tabConfig": "{}"}),
        server.delete(path, token),
        server.get("/api/v1/dashboard/tabs/nonsense%00", token),
    ):
        assert refusal(answer) == (404, "TAB_NOT_FOUND")


@pytest.mark.parametrize("tab_config", ["{broken", "[]", "[" * 100_000, "x" * 500_001, None, {"widgets": []}])
def test_what_is_no_tab_is_not_stored(server: Any, tab_config: Any) -> None:
    server.account()
    token = server.log_in()
    (tab,) = result(server.get("/api/v1/dashboard/tabs", token))
    path = f"/api/v1/dashboard/tabs/{tab['id']}"
    assert refusal(server.put(f"{path}/configs", token, {"tabConfig": tab_config})) == (400, "INVALID_FORMAT")
    assert result(server.get(path, token))["widgets"] == '{"widgets":[]}'


def test_tabs_belong_to_the_organization_and_their_number_is_bounded(
    server: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    admin = server.account()
    server.member(admin, "bob@example.org")
    server.account("eve@example.org")
    bob, eve = server.log_in("bob@example.org"), server.log_in("eve@example.org")
    (tab,) = result(server.get("/api/v1/dashboard/tabs", bob))
    message(server.put(f"/api/v1/dashboard/tabs/{tab['id']}", bob, {"name": "Ours"}))
    assert result(server.get("/api/v1/dashboard/tabs", server.log_in()))[0]["name"] == "Ours"
    assert refusal(server.get(f"/api/v1/dashboard/tabs/{tab['id']}", eve)) == (404, "TAB_NOT_FOUND")
    assert refusal(server.delete(f"/api/v1/dashboard/tabs/{tab['id']}", eve)) == (404, "TAB_NOT_FOUND")
    monkeypatch.setattr("mosaic_server.storage.tabs.MOST_TABS", 2)
    message(server.post("/api/v1/dashboard/tabs", bob, {"name": "Second"}))
    answer = server.post("/api/v1/dashboard/tabs", bob, {"name": "Third"})
    assert (answer.status_code, answer.json()["code"]) == (409, "signal.too_many")


def test_who_may_only_observe_looks_at_tabs_and_maps_and_changes_none(server: Any) -> None:
    admin = server.account()
    server.member(admin, "bob@example.org")
    token = server.log_in()
    server.put("/api/v1/organization", token, {"defaultRole": "observer"})
    bob = server.log_in("bob@example.org")
    (tab,) = result(server.get("/api/v1/dashboard/tabs", bob))
    path = f"/api/v1/dashboard/tabs/{tab['id']}"
    result(server.get(path, bob))
    page(server.get("/api/v1/occupancy_map", bob), MAP)
    for answer in (
        server.post("/api/v1/dashboard/tabs", bob, {"name": "x"}),
        server.put(path, bob, {"name": "x"}),
        server.put(f"{path}/configs", bob, {"tabConfig": "{}"}),
        server.delete(path, bob),
        upload(server, bob),
        server.delete(f"/api/v1/occupancy_map/{uuid4()}", bob),
    ):
        assert refusal(answer) == (403, "ACCESS_DENIED")


# --- occupancy maps


def upload(server: Any, token: str, name: str = "room", **parts: Any) -> httpx.Response:
    files = {"pgm_file": ("C:\\maps\\..\\room.pgm", PGM), "yaml_file": ("/home/ada/room.yaml", YAML)} | parts
    given = {part: file for part, file in files.items() if file is not None}
    headers = {"Authorization": f"Bearer {token}"}
    answer: httpx.Response = server.http.post(
        "/api/v1/occupancy_map", headers=headers, data={"name": name} if name else {}, files=given
    )
    return answer


def test_a_map_is_uploaded_listed_handed_out_and_removed(server: Any) -> None:
    server.account()
    token = server.log_in()
    message(upload(server, token))
    (listed,) = page(server.get("/api/v1/occupancy_map?skip=0&limit=10", token), MAP)
    assert (listed["pgmFilePath"], listed["yamlFilePath"]) == ("room.pgm", "room.yaml"), "names, of no machine's folder"
    path = f"/api/v1/occupancy_map/{listed['id']}"
    assert result(server.get(path, token)) == listed
    for part, kind, content in (("pgm", "application/octet-stream", PGM), ("yaml", "application/x-yaml", YAML)):
        answer = server.get(f"{path}/{part}", token)
        assert (answer.status_code, answer.headers["content-type"], answer.content) == (200, kind, content)
    archive = server.get(f"{path}/download", token)
    assert archive.headers["content-type"] == "application/zip"
    with zipfile.ZipFile(io.BytesIO(archive.content)) as files:
        assert {name: files.read(name) for name in files.namelist()} == {"room.pgm": PGM, "room.yaml": YAML}
    message(server.delete(path, token))
    for gone in (path, f"{path}/pgm", f"{path}/yaml", f"{path}/download", "/api/v1/occupancy_map/nonsense%00"):
        assert refusal(server.get(gone, token)) == (404, "OCCUPANCY_MAP_NOT_FOUND")
    assert refusal(server.delete(path, token)) == (404, "OCCUPANCY_MAP_NOT_FOUND")


def test_a_map_of_several_megabytes_is_taken_and_nobody_else_sees_it(server: Any) -> None:
    server.account()
    server.account("eve@example.org")
    token, eve = server.log_in(), server.log_in("eve@example.org")
    large = b"P5 2000 2000 255\n" + bytes(4_000_000)
    message(upload(server, token, pgm_file=("large.pgm", large)))
    (listed,) = page(server.get("/api/v1/occupancy_map", token), MAP)
    path = f"/api/v1/occupancy_map/{listed['id']}"
    assert server.get(f"{path}/pgm", token).content == large
    assert refusal(server.get(f"{path}/pgm", eve)) == (404, "OCCUPANCY_MAP_NOT_FOUND")
    assert refusal(server.delete(path, eve)) == (404, "OCCUPANCY_MAP_NOT_FOUND")
    assert page(server.get("/api/v1/occupancy_map", eve), MAP) == []


@pytest.mark.parametrize(
    ("parts", "why"),
    [
        ({"name": ""}, "name"),
        ({"pgm_file": None}, "pgm_file is missing"),
        ({"yaml_file": None}, "yaml_file is missing"),
        ({"pgm_file": ("a.pgm", b"\x89PNG\r\n")}, "no PGM picture"),
        ({"pgm_file": ("a.pgm", b"P5 400 400 255\n" + bytes(99))}, "too short for 400 x 400"),
        ({"yaml_file": ("a.yaml", b"image: [")}, "no YAML"),
        ({"yaml_file": ("a.yaml", b"image: room.pgm")}, "resolution"),
        ({"yaml_file": ("a.yaml", b"x" * 65_537)}, "larger than"),
    ],
)
def test_what_is_no_map_is_refused_with_the_reason(server: Any, parts: dict[str, Any], why: str) -> None:
    server.account()
    token = server.log_in()
    answer = upload(server, token, **parts)
    assert refusal(answer) == (400, "INVALID_FORMAT")
    assert why in answer.json()["message"]
    assert page(server.get("/api/v1/occupancy_map", token), MAP) == []


def test_uploads_are_bounded_and_only_for_who_is_logged_in(server: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    server.account()
    token = server.log_in()
    assert server.http.post("/api/v1/occupancy_map", files={"pgm_file": PGM}).status_code == 401
    headers = {"Authorization": f"Bearer {token}"}
    huge = server.http.post("/api/v1/occupancy_map", headers=headers, content=bytes(17_000_000))
    assert huge.status_code == 413
    assert refusal(server.post("/api/v1/occupancy_map", token, {"name": "x"})) == (400, "INVALID_FORMAT")
    monkeypatch.setattr("mosaic_server.storage.occupancy_maps.MOST_BYTES", len(PGM) + len(YAML))
    message(upload(server, token))
    answer = upload(server, token)
    assert (answer.status_code, answer.json()["code"]) == (409, "signal.too_many")


# --- connections


def test_ice_servers_are_a_bare_array_with_one_address_each(server: Any) -> None:
    server.account()
    urls = ("turn:turn.example.org:3478?transport=udp", "turn:turn.example.org:3478?transport=tcp")
    server.work(add_ice_server, IceServer(urls=urls, username="u", credential="c"))
    server.work(add_ice_server, IceServer(urls=("stun:stun.example.org:3478",)))
    token = server.log_in()
    for path in ("/api/v1/ice-servers", "/api/v1/webrtc/ice-servers"):
        shown = server.get(path, token).json()
        shown.sort(key=lambda one: one["urls"] not in urls)  # both may be of one millisecond
        assert shown == [
            *({"urls": url, "username": "u", "credential": "c"} for url in urls),
            {"urls": "stun:stun.example.org:3478", "username": "", "credential": ""},
        ]


def connected(server: Any, extensions: dict[str, int] | None = None) -> tuple[str, Any]:
    """The robot's id, and the answer to an operator who asks for a connection to it."""
    robot_id, robot_token = server.robot(server.account())
    token = server.log_in()
    user = server.connect_operator(token, extensions)
    robot = server.connect_robot(robot_id, robot_token)
    robot.status(0)
    user.send("status.subscribe", {"robotIds": [robot_id]})
    while user.expect("status.update")["status"] != 0:
        pass
    return robot_id, result(server.post("/api/v1/webrtc/connection", token, {"robotIds": [robot_id]}))


def test_an_original_page_gets_nothing_but_the_ids_of_its_connections(server: Any) -> None:
    robot_id, made = connected(server)
    assert made.keys() == {"sessions"}
    (session,) = made["sessions"]
    assert session.keys() == {"robotId", "rtcSessionId"}
    assert session["robotId"] == robot_id
    assert uuid(session["rtcSessionId"])


def test_an_operator_that_knows_sessions_is_told_its_own(server: Any) -> None:
    _, made = connected(server, {"multiPeer": 1})
    assert made["sessions"][0].keys() == {"robotId", "rtcSessionId", "sessionId"}


# --- from elsewhere


def test_a_page_from_elsewhere_works_once_its_address_is_allowed(
    settings: Any, start_server: Callable[..., Any]
) -> None:
    origin = "https://dashboard.example.org"
    with start_server(replace(settings, allowed_origins=frozenset({origin}))) as server:
        server.account()
        for method in ("GET", "POST", "PUT", "DELETE"):
            asked = {
                "Origin": origin,
                "Access-Control-Request-Method": method,
                "Access-Control-Request-Headers": "authorization,content-type",
            }
            answer = server.http.options("/api/v1/organization/users", headers=asked)
            assert answer.status_code == 200
            assert answer.headers["access-control-allow-origin"] == origin
            assert method in answer.headers["access-control-allow-methods"]
            assert server.http.options("/api/v1/robots", headers=asked | {"Origin": "https://a.b"}).status_code == 400
        user = server.open("/ws/user", origin=origin)
        user.expect("authorize.req")


# --- who may not


@pytest.mark.parametrize(
    ("method", "path"),
    [
        ("GET", "/api/v1/organization/users"),
        ("GET", "/api/v1/dashboard/tabs"),
        ("POST", "/api/v1/dashboard/tabs"),
        ("GET", f"/api/v1/dashboard/tabs/{NOBODY}"),
        ("GET", "/api/v1/occupancy_map"),
        ("GET", f"/api/v1/occupancy_map/{NOBODY}/pgm"),
        ("POST", f"/api/v1/robot-auth/simple-token/{NOBODY}"),
        ("GET", "/api/v1/webrtc/ice-servers"),
    ],
)
def test_without_a_log_in_nothing_is_told(server: Any, method: str, path: str) -> None:
    assert refusal(server.http.request(method, path)) == (401, "AUTHENTICATION_FAILED")
