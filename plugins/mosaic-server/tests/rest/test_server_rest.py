"""The REST interface on the real server."""

from __future__ import annotations

import json
import logging
from collections.abc import Callable
from dataclasses import replace
from typing import Any
from uuid import uuid4

import httpx
import jwt
import pytest
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PublicKey
from jwt.utils import base64url_decode
from sqlalchemy import select
from sqlalchemy.orm import Session

from mosaic_core.words.ice import IceServer
from mosaic_server.security.login_limits import PER_EMAIL_AND_ADDRESS
from mosaic_server.security.one_time_codes import LIFETIME_S
from mosaic_server.storage.accounts import add_account
from mosaic_server.storage.ice_servers import add_ice_server
from mosaic_server.storage.tables import Account, RobotRow

PASSWORD = "correct horse battery"  # noqa: S105 - of throw-away accounts


def test_the_server_says_what_it_is_to_anybody(server: Any) -> None:
    data = server.http.get("/api/v1/server").json()["resultData"]
    assert data["name"] == "mosaic-server"
    assert data["extensions"]["multiPeer"] == 1
    assert data["signup"] is True
    assert server.http.get("/healthz").json() == {"status": "ok"}


def test_log_in_and_me(server: Any) -> None:
    person = server.account()
    me = server.get("/api/v1/users/me", server.log_in("ADA@example.org ")).json()
    assert me["resultCode"] == 100
    assert me["resultData"].keys() == {
        "id", "email", "isActive", "isOrganizationAdmin", "isProgram", "fullName", "createdAt", "updatedAt",
    }  # fmt: skip
    assert me["resultData"]["id"] == person.id
    assert me["resultData"]["createdAt"].endswith("Z")


@pytest.mark.parametrize("email", ["ada@example.org", "nobody@example.org"])
def test_wrong_passwords_look_alike_and_are_slowed_down(server: Any, email: str) -> None:
    server.account()
    answers = [
        server.http.post("/api/v1/account/login/access-token", json={"username": email, "password": "wrong"})
        for _ in range(PER_EMAIL_AND_ADDRESS.failures + 1)
    ]
    assert answers[0].status_code == 401
    assert answers[0].json() == {
        "resultCode": "INVALID_PASSWORD",
        "resultData": None,
        "code": "auth.failed",
        "message": "e-mail or password is wrong",
        "cure": "Check what was typed; an administrator of the server can set a new password.",
    }
    assert answers[-1].status_code == 429
    assert int(answers[-1].headers["retry-after"]) > 0


@pytest.mark.parametrize("header", [None, "Bearer nonsense", "Basic YTpi", "Bearer"])
def test_without_a_valid_token_nothing_is_told(server: Any, header: str | None) -> None:
    headers = {"Authorization": header} if header else {}
    for path in ("/api/v1/users/me", "/api/v1/robots", "/api/v1/ice-servers", "/api/v1/webrtc/ice-servers"):
        answer = server.http.get(path, headers=headers)
        assert answer.status_code == 401
        assert answer.json()["code"].startswith("auth.")


def test_a_one_time_code_works_once(server: Any) -> None:
    server.account()
    issued = server.post("/api/v1/account/one-time-code", server.log_in()).json()["resultData"]
    assert issued["expiresInS"] == LIFETIME_S
    code = issued["code"]
    first = server.http.post("/api/v1/account/login/one-time", json={"code": code})
    assert server.get("/api/v1/users/me", first.json()["resultData"]["accessToken"]).status_code == 200
    again = server.http.post("/api/v1/account/login/one-time", json={"code": code})
    assert again.status_code == 401
    assert "wrong, was used already, or is too old" in again.text


def test_sign_up_only_where_it_is_allowed(
    server: Any, settings: Any, start_server: Callable[..., Any], tmp_path: Any
) -> None:
    new = {"email": "new@example.org", "password": PASSWORD, "fullName": "New"}
    assert server.http.post("/api/v1/account/signup", json=new).json()["resultCode"] == 100
    assert server.http.post("/api/v1/account/signup", json=new).status_code == 409
    server.log_in("new@example.org")
    with start_server(replace(settings, allow_signup=False, data_dir=tmp_path / "closed")) as closed:
        answer = closed.http.post("/api/v1/account/signup", json=new)
        assert answer.status_code == 403
        assert answer.json()["resultCode"] == "ACCESS_DENIED"


def test_a_new_password_ends_older_log_ins(server: Any) -> None:
    server.account()
    token = server.log_in()
    change = {"currentPassword": PASSWORD, "newPassword": "another password"}
    headers = {"Authorization": f"Bearer {token}"}
    wrong = server.http.put("/api/v1/users/me/password", headers=headers, json=change | {"currentPassword": "wrong"})
    assert wrong.status_code == 400
    assert server.http.put("/api/v1/users/me/password", headers=headers, json=change).status_code == 200
    assert server.get("/api/v1/users/me", token).status_code == 401


def test_robots_are_made_changed_listed_and_removed(server: Any) -> None:
    server.account()
    token = server.log_in()
    headers = {"Authorization": f"Bearer {token}"}
    created = server.post("/api/v1/robots", token, {"name": "rover", "description": "d", "authType": 1, "status": 5})
    robot_id = created.json()["resultData"]["id"]
    page = server.get("/api/v1/robots?skip=0&limit=10", token).json()["resultData"]
    assert page["count"] == 1
    assert page["data"][0] == {
        "id": robot_id,
        "name": "rover",
        "description": "d",
        "status": 5,
        "authType": 1,
        "organizationId": page["data"][0]["organizationId"],
        "connectorConfig": None,
        "connectorConfigIsStored": False,
        "isOnline": False,
        "myRole": "supervisor",
    }
    server.http.put(f"/api/v1/robots/{robot_id}", headers=headers, json={"name": "new", "connectorConfig": "{}"})
    shown = server.get(f"/api/v1/robots/{robot_id}", token).json()["resultData"]
    assert (shown["name"], shown["description"], shown["connectorConfig"]) == ("new", "d", "{}")
    assert server.get(f"/api/v1/robots/{robot_id}/catalogue", token).json() == {"resultCode": 100, "resultData": None}
    assert server.http.delete(f"/api/v1/robots/{robot_id}", headers=headers).status_code == 200
    assert server.get(f"/api/v1/robots/{robot_id}", token).status_code == 404


def test_robots_of_strangers_do_not_exist(server: Any) -> None:
    robot_id, _ = server.robot(server.account())
    server.account("eve@example.org")
    eve = server.log_in("eve@example.org")
    headers = {"Authorization": f"Bearer {eve}"}
    assert server.get("/api/v1/robots", eve).json()["resultData"]["count"] == 0
    for answer in (
        server.get(f"/api/v1/robots/{robot_id}", eve),
        server.get(f"/api/v1/robots/{robot_id}/catalogue", eve),
        server.http.put(f"/api/v1/robots/{robot_id}", headers=headers, json={"name": "x"}),
        server.http.delete(f"/api/v1/robots/{robot_id}", headers=headers),
        server.post("/api/v1/robots/auth/simple-token", eve, {"robotId": robot_id}),
    ):
        assert answer.status_code == 404
        assert answer.json()["resultCode"] == "ROBOT_NOT_FOUND"
    answer = server.post("/api/v1/webrtc/connection", eve, {"robotIds": [robot_id]})
    assert answer.json()["resultCode"] == "ROBOT_NOT_IN_SAME_ORGANIZATION"


def test_connections_are_refused_with_the_original_names(server: Any) -> None:
    robot_id, robot_token = server.robot(server.account())
    token = server.log_in()

    def refusal(**body: Any) -> str:
        return server.post("/api/v1/webrtc/connection", token, {"robotIds": [robot_id]} | body).json()["resultCode"]

    assert refusal(robotIds=[str(uuid4())]) == "ROBOT_NOT_FOUND"
    assert refusal(robotIds=[]) == "INVALID_FORMAT"
    assert refusal(sessionId="nonsense") == "INVALID_FORMAT"
    assert refusal() == "USER_WS_SESSION_NOT_EXIST"
    server.connect_operator(token)
    assert refusal() == "ROBOT_WS_SESSION_NOT_EXIST"
    server.connect_robot(robot_id, robot_token)
    assert refusal() == "ROBOT_NOT_READY_TO_CONNECT", "it is connected but did not say that it is ready"


def test_a_renewed_token_replaces_the_old_one_at_once(server: Any) -> None:
    robot_id, old = server.robot(server.account())
    robot = server.connect_robot(robot_id, old)
    token = server.log_in()
    new = server.post("/api/v1/robots/auth/simple-token", token, {"robotId": robot_id}).json()["resultData"]["token"]
    assert robot.close_code() == 4401
    server.connect_robot(robot_id, new)


def test_the_ticket_is_signed_for_exactly_this_connection(server: Any) -> None:
    person = server.account()
    robot_id, robot_token = server.robot(person)
    robot = server.open("/ws/robot")
    robot.expect("authorize.req")
    robot.send("authorize", {"robotId": robot_id, "data": robot_token, "extensions": {"tickets": 1, "multiPeer": 1}})
    robot.expect("authorize.res")
    key = robot.expect("session.welcome")["keys"][0]
    token = server.log_in()
    server.connect_operator(token, {"multiPeer": 1})
    made = server.post("/api/v1/webrtc/connection", token, {"robotIds": [robot_id]}).json()["resultData"]["sessions"][0]
    ticket = robot.expect("signaling.prepare_connection")["ticket"]
    assert jwt.get_unverified_header(ticket)["kid"] == key["kid"]
    public = Ed25519PublicKey.from_public_bytes(base64url_decode(key["x"]))
    claims = jwt.decode(ticket, public, algorithms=["EdDSA"])
    assert claims["sub"] == person.id
    assert claims["peerId"] == made["rtcSessionId"]
    assert (claims["sessionId"], claims["robotId"]) == (made["sessionId"], robot_id)
    assert claims["exp"] - claims["iat"] == 300


def test_ice_servers_reach_operators_and_robots(server: Any) -> None:
    robot_id, robot_token = server.robot(server.account())
    ice = IceServer(urls=("turn:turn.example.org",), username="u", credential="c")
    server.work(add_ice_server, ice)
    url = "turn:turn.example.org:3478?transport=udp"
    token = server.log_in()
    for path in ("/api/v1/ice-servers", "/api/v1/webrtc/ice-servers"):
        assert server.get(path, token).json() == [{"urls": url, "username": "u", "credential": "c"}]
    robot = server.open("/ws/robot")
    robot.expect("authorize.req")
    robot.send("authorize", {"robotId": robot_id, "data": robot_token, "extensions": {"iceServers": 1}})
    robot.expect("authorize.res")
    assert robot.expect("session.welcome")["iceServers"] == [{"urls": [url], "username": "u", "credential": "c"}]


def test_nothing_secret_is_stored_in_clear(server: Any) -> None:
    _, robot_token = server.robot(server.account())

    def everything(session: Session) -> str:
        robot, account = session.scalars(select(RobotRow)).one(), session.scalars(select(Account)).one()
        return f"{robot.token_hash} {account.password_hash}"

    stored = server.work(everything)
    assert robot_token not in stored
    assert PASSWORD not in stored
    assert "$argon2id$" in stored
    assert robot_token.encode() not in server.database().file.read_bytes()
    assert server.database().file.stat().st_mode & 0o777 == 0o600


def test_nothing_secret_is_logged(server: Any, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.DEBUG)
    for name in ("websockets", "uvicorn", "mosaic_server"):
        logging.getLogger(name).setLevel(logging.INFO)
    robot_id, robot_token = server.robot(server.account())
    token = server.log_in()
    robot = server.connect_robot(robot_id, robot_token)
    server.connect_operator(token)
    code = server.post("/api/v1/account/one-time-code", token).json()["resultData"]["code"]
    server.http.get(f"/api/v1/server?code={code}&token={robot_token}")
    server.http.post("/api/v1/account/login/access-token", json={"username": "ada@example.org", "password": 5})
    robot.send("authorize", {"robotId": robot_id, "data": {"odd": robot_token}})
    robot.expect("authorize.res")
    logged = "\n".join(
        record.getMessage() for record in caplog.records if record.name.startswith(("mosaic", "uvicorn"))
    )
    assert "/api/v1/server" in logged
    for secret in (robot_token, token, code, PASSWORD):
        assert secret not in logged


@pytest.mark.parametrize("path", ["account/login/access-token", "account/signup", "pairing", "robots/auth/check"])
def test_of_somebody_who_need_not_be_signed_in_only_a_small_body_is_read(server: Any, path: str) -> None:
    fields = {str(number): 1 for number in range(2000)}
    assert server.http.post(f"/api/v1/{path}", json=fields).status_code == 413


@pytest.mark.parametrize(
    ("authorization", "code"),
    [(None, "auth.required"), ("Basic YTpi", "auth.required"), ("Bearer of-somebody-else", "auth.required")],
)
def test_of_a_stranger_no_large_body_is_read_at_any_route(server: Any, authorization: str | None, code: str) -> None:
    """It would be, before the route asks who sends it."""
    headers = {} if authorization is None else {"Authorization": authorization}
    nested = {"robotIds": [[]] * 20_000}
    answer = server.http.post("/api/v1/webrtc/connection", json=nested, headers=headers)
    assert (answer.status_code, answer.json()["code"]) == (401, code)
    server.account()
    known = {"Authorization": f"Bearer {server.log_in()}"}
    answer = server.http.post("/api/v1/webrtc/connection", json=nested, headers=known)
    assert (answer.status_code, answer.json()["code"]) == (400, "rest.bad_request")


def test_a_body_may_not_be_huge(server: Any) -> None:
    body = b"x" * 1_100_000
    assert server.http.post("/api/v1/account/signup", content=body).status_code == 413

    def dripping() -> Any:
        for _ in range(110):
            yield b"x" * 10_000

    try:
        answer = server.http.post("/api/v1/account/signup", content=dripping())
        assert answer.status_code >= 400
    except httpx.TransportError:
        pass  # cut off is as good


def test_only_known_host_names_are_answered(settings: Any, start_server: Callable[..., Any]) -> None:
    with start_server(replace(settings, allowed_hosts=frozenset({"127.0.0.1"}))) as server:
        assert server.http.get("/healthz").status_code == 200
        assert server.http.get("/healthz", headers={"Host": "evil.example"}).status_code == 421


def test_every_answer_carries_the_security_headers(server: Any) -> None:
    for path in ("/healthz", "/", "/api/v1/users/me"):
        headers = server.http.get(path).headers
        assert headers["x-content-type-options"] == "nosniff"
        assert "frame-ancestors 'none'" in headers["content-security-policy"]
        # A page that shares a phone asks for all three.
        assert {"camera=(self)", "microphone=(self)", "geolocation=(self)"} < set(
            headers["permissions-policy"].split(", ")
        )
    assert server.http.get("/api/v1/server").headers["cache-control"] == "no-store"


def test_the_dashboard_is_served_as_a_single_page_application(
    settings: Any, start_server: Callable[..., Any], tmp_path: Any
) -> None:
    built = tmp_path / "dashboard"
    (built / "assets").mkdir(parents=True)
    (built / "index.html").write_text("<title>dashboard</title>")
    (built / "assets" / "app-1a2b.js").write_text("1")
    (tmp_path / "secret.txt").write_text("secret")
    with start_server(replace(settings, dashboard_dir=built)) as server:
        for page in ("/", "/robots/1", "/index.html"):
            answer = server.http.get(page)
            assert "dashboard" in answer.text
            assert answer.headers["cache-control"] == "no-cache"
        assert "immutable" in server.http.get("/assets/app-1a2b.js").headers["cache-control"]
        for missing in ("/assets/gone.js", "/api/v1/nothing", "/..%2fsecret.txt", "/%2e%2e/secret.txt"):
            answer = server.http.get(missing)
            assert answer.status_code == 404
            assert "secret" not in answer.text or missing.endswith("secret.txt")


def test_the_dashboard_comes_compressed_as_the_browser_takes_it(
    settings: Any, start_server: Callable[..., Any], tmp_path: Any
) -> None:
    built = tmp_path / "dashboard"
    (built / "assets").mkdir(parents=True)
    (built / "index.html").write_text("<title>dashboard</title>")
    for suffix, content in (("", "as built"), (".br", "br"), (".gz", "gzip")):
        (built / "assets" / f"app-1a2b.js{suffix}").write_text(content)
    cases = {
        "gzip, deflate, br": "br",
        "gzip": "gzip",
        "GZIP;q=0.5, br;q=0": "gzip",
        "identity": None,
        "br;q=0.0": None,
        "": None,
    }
    with start_server(replace(settings, dashboard_dir=built)) as server:
        for accepted, encoding in cases.items():
            with server.http.stream("GET", "/assets/app-1a2b.js", headers={"Accept-Encoding": accepted}) as answer:
                assert b"".join(answer.iter_raw()).decode() == (encoding or "as built"), accepted
            assert answer.headers.get("content-encoding") == encoding
            assert answer.headers["content-type"].startswith("text/javascript")
            assert answer.headers["vary"] == "Accept-Encoding"
            assert "immutable" in answer.headers["cache-control"]
        assert server.http.get("/").headers.get("content-encoding") is None, "nothing compressed lies beside it"


def test_a_missing_dashboard_says_what_to_run(server: Any, settings: Any, start_server: Any, tmp_path: Any) -> None:
    bare = replace(settings, dashboard_dir=tmp_path / "none", data_dir=tmp_path / "other")
    with start_server(bare) as without:
        answer = without.http.get("/")
        assert answer.status_code == 503
        assert "npm run build" in answer.text


def test_unknown_routes_and_broken_bodies_answer_in_the_envelope(server: Any) -> None:
    for answer in (
        server.http.get("/api/v1/nothing"),
        server.http.post("/api/v1/account/login/access-token", content=b"{broken"),
        server.http.post("/api/v1/account/login/access-token", json={"username": 5, "password": "geheim!!"}),
    ):
        assert answer.status_code in (400, 404)
        assert answer.json().keys() == {"resultCode", "resultData", "code", "message", "cure"}
        assert "geheim" not in answer.text


def test_openapi_names_every_route_and_is_written_once(server: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    paths = server.http.get("/openapi.json").json()["paths"]
    monkeypatch.setattr(json, "dumps", lambda *_, **__: 1 / 0)
    assert server.http.get("/openapi.json").status_code == 200
    assert {"/api/v1/webrtc/connection", "/api/v1/robots/{robot_id}/catalogue", "/api/v1/users/me"} <= paths.keys()


def test_a_member_who_does_not_administer_may_not_change_robots(server: Any) -> None:
    person = server.work(add_account, "member@example.org", PASSWORD)

    def demote(session: Session) -> None:
        session.get_one(Account, person.id).is_organization_admin = False

    server.work(demote)
    answer = server.post("/api/v1/robots", server.log_in("member@example.org"), {"name": "x"})
    assert answer.status_code == 403
